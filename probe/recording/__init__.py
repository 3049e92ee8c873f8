"""Recordings: HDF5 files of frames that survive a crash, and those of others.

    record        frames -> `touch.h5`, or `touch-0001.h5`, ... when it rolls over
    read          file or series -> frames, lazily
    repair        what a killed writer or a bad copy left -> a recording
    table         recording -> CSV
    imported      .npy, .npz, .mat, HDF5, CSV or a folder of images -> recording
      arrays        where the images stand in such a file
    layout, names                    datasets and attributes, file names
    write, lock                      one file while it is written, and who writes it
    opened, superblock, checked      why a file cannot be opened, what it must hold
    padded                           a file without its end, seen as if it were whole

While frames come in, a recording is called `touch.part.h5`; it gets its name when it is
closed. So a file under its final name is whole, and a part file whose writer is gone is
repaired, not lost. h5py loads when a file is opened, not before.
"""
