"""Recordings: HDF5 files of frames that survive a crash, and those of others.

    record        frames -> `touch.h5`, or `touch-0001.h5`, ... when it rolls over
    read          file or series -> frames, lazily
    repair        what a killed writer left -> a closed recording
    csv           recording -> table
    imported      .npy, .mat, any HDF5 array (N, 16, 16) -> recording
      arrays, scaled    where the array stands in the file, and counts from what are none
    layout, names, opened, lock     datasets, file names, opening, who is writing

While frames come in, a recording is called `touch.part.h5`; it gets its name when it is
closed. So a file under its final name is whole, and a part file whose writer is gone is
repaired, not lost. h5py loads when a file is opened, not before.
"""
