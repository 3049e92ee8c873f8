"""`open-bench`: the part, the touch and the answer in a web page.

::

    command         open-bench: its options
    serve           options -> a server that runs
    guard           who may ask: host, origin, token, sizes, and what the page may load
    app, routes     the page, its live line, the requests
    session         one probe and all that is done with it; shared by every page
    controllers     calibration, sensor and print, as the page works them
    feed            frames of a probe that may go and come back, or of a recording
    frames          each frame: recorded, calibrated, shown, offered
    calibration     what counts mean now; a new calibration, a load at a time
    reading         frames -> answers, mosaics, one belief;  touch_log  a record of each touch
    simulated       a probe over registered parts that comes down where one clicks
    press_sequence  the forces on that probe, frame by frame
    broker          the newest of every topic, for any number of pages
    answers, lab_json   answers and registered things as JSON;  message  frames, mosaics as bytes
    files           recordings, calibrations and printed parts: what may be read and written
    encode_object   what is asked of `encode-object`: an example, what faces promise

The page is TypeScript in `web/`; `npm ci && npm run build` there writes `static/`, which is
shipped. Thesis 4.2 (the display programme), 4.3, 6.3.
"""
