"""The probe's firmware in C, and the host that runs it on an emulated AVR."""
