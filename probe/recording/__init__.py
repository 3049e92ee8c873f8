"""Recordings: HDF5 files of frames that survive a crash, and those of others.

    record    frames -> `touch.h5`, or `touch-0001.h5`, ... when it rolls over
    read      file or series -> frames, lazily
    repair    what a killed writer or a bad copy left -> a recording
    journal   the file while frames come in: fixed records, appended
    hdf5      the file when it is closed: datasets, checked and written
    guard     HDF5 files of unknown origin, checked by hand before they are read
    files     names of the files, who writes them, errors
    layout    datasets, attributes, blocks of frames
    imported  .npy, .npz, .mat, HDF5, CSV or a folder of images -> recording
    zarr      Zarr stores, as FTP-1 has them -> arrays of images
    table, mcap, ros            recording <-> CSV, MCAP, ROS 2 messages

A file under its final name is whole; `touch.part.h5` is being written, or its writer was killed:
then it is read to its last whole record. h5py loads when a file is opened, not before.
"""
