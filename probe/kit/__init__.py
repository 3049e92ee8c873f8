"""The probe itself, to be built: `probe-kit TYPE -o DIR`. Thesis 4.1, 4.2, appendix 4.

::

    sizes       sensor type -> lengths of the parts
    model       sizes -> solids of the CAD kernel, STEP text and triangles, checked
    coupon      a small encoded plate for the first touch
    board       electric parts, and the wiring picture
    sheet       casting and assembly, parts list, tolerances: one page
    make        all of it into a folder
"""
