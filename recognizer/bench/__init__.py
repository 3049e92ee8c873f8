"""`open-bench`: the part, the touch and the answer in a web page.

::

    command             open-bench: its options
    serve               from the options to a server that runs;  settings  its limits
    app                 the routes: page, live line;  control, lab  what is done, registered
    guard               who may ask: host, origin, token, sizes, and what the page may load
    session             one probe and all that is done with it; shared by every page
    frames              what is done with each frame: recorded, calibrated, shown, offered
    feed                frames of a probe that may go and come back;  replay  those of a recording
    calibration_state   what counts mean now: calibration, bias
    calibration_guide   a calibration, a load at a time;  calibration_desk  what the page asks of it
    sensor_desk         flips, mounting, what is learned of the sensor
    print_check         how a part was printed;  checks  both as requests
    simulated           a probe over registered parts that comes down where it is told
    press_sequence      what that probe feels, frame by frame;  serial_line  how it is plugged in
    read_trigger        when a touch is worth reading
    recognition_thread  touch -> answer;  touch_log  one record each
    face_mosaics        answers -> mosaics;  scan_mode  touches -> one belief
    images              a frame through the filters
    broker              the newest of every topic, for any number of pages
    answers, lab_json   answers and registered things as JSON;  message  frames and mosaics as bytes
    files               recordings, calibrations and printed parts: what may be read
    uploads             recordings that are sent in
    picture, promise    an object as a small picture; what its faces promise

The page is TypeScript in `web/`; `npm ci && npm run build` there writes `static/`, which is
shipped. Thesis 4.2 (the display programme), 4.3, 6.3.
"""
