"""`open-bench`: the part, the touch and the answer in a web page.

::

    command     open-bench: options, and what an error means for the exit code
    serve       from the options to a server that runs
    app         the routes: page, live line;  work   what is done;  holdings   what is registered
    guard       who may ask: host, origin, token, sizes, and what the page may load
    session     one probe and all that is done with it; shared by every page
    feed        frames of a probe that may go and come back;  replay   those of a recording
    meaning     what counts mean now: calibration, bias
    simulated   a probe over registered parts that comes down where it is told
    beats       what that probe feels, beat by beat;  line   its serial line
    images      a frame through the filters
    watch       when a touch is worth reading
    reading     touch -> answer -> mosaic, in a thread of its own
    telling     answers, mosaics and states as the page gets them
    guided      calibration, a load at a time
    bulletin    the newest of every topic, for any number of pages
    message     frames and mosaics as bytes
    scenes      registered objects, arrays and alphabets as JSON
    files       recordings, calibrations and printed parts: what may be read

The page is TypeScript in `web/`; `npm ci && npm run build` there writes `static/`, which is
shipped. Thesis 4.2 (the display programme), 4.3, 6.3.
"""
