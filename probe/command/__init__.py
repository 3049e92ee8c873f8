"""`probe-sensor`: list, info, calibrate, record, replay, export, simulate, live."""
