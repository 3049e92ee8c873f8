"""The closed loop: touches of written parts, simulated, read, and compared with the truth.

::

    campaign     how many touches, of which kinds and levels
    encoded_set  the objects that are touched, and what some kinds need besides
    touch_plan   the plan of a touch and the scenes of faces;  draw  number -> touch and counts
    trial        touch -> answer -> verdict, a row
    run          which touches are left;  workers  who does them;  files  where they go
    results      rows -> shares and errors (statistics);  studies, extremes  add theirs
    report       results, where they come from, page (pictures, flat_faces)
    compare      two runs, or the worlds of several;  repeat  one touch again
    dataset      touches with their truth, for training;  dataset_formats  their files
    printing     printed surfaces
    benchmark    frozen touches, and readers compared on them (benchmark_readers)
    pipeline     all of it in order: `validate`;  command  validate-set
"""
