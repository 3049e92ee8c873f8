"""`open-bench`: the part, the touch and the answer in a web page.

::

    command, options   open-bench
    serve              options -> a server that runs
    guard              who may ask: host, origin, token, sizes, and what the page may load
    app, routes        the page, its live line, the requests;  making  those that make parts
    controllers        calibration, sensor and print, as the page works them
    session            one probe and all that is done with it; shared by every page
    feed               frames of a probe that may go and come back, or of a recording
    frames             each frame: recorded, calibrated, shown, offered for recognition
    reading            frames -> answers, mosaics, one belief;  touch_log  a record of each touch
    simulated          a probe over registered parts that comes down where one clicks
    broker             the newest of every topic, for any number of pages
    answers, lab_json  answers and registered things as JSON;  message  frames, mosaics as bytes
    files              recordings, calibrations and printed parts: what may be read and written
    encode_object      parts, an example and expected recognition rates by `encode-object`

The page is TypeScript in `web/`; `npm ci && npm run build` there writes `static/`, which is
shipped. Thesis 4.2 (the display programme), 4.3, 6.3.
"""
