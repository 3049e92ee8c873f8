"""The probe itself, to be built: `probe-kit TYPE -o DIR`. Thesis 4.1, 4.2, appendix 4.

Sensor type -> printable parts (mould, housing, cap, coupon), parts list, wiring, sheet.

::

    sizes       what the parts measure, from the sensor type and from settings
    model       sizes -> solids of the CAD kernel
    mesh        solid -> STEP text and triangles, checked
    coupon      a small encoded plate for the first touch
    board       what is soldered, and the wiring picture
    tolerances  what a dimension costs in reading, measured
    sheet       casting and assembly, parts list: one page
    make        all of it into a folder
"""
