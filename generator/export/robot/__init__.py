"""What robots and simulators load: MJCF, URDF, SDF and USD of an object as one rigid body.

    model         parts -> meshes, convex pieces, mass and inertia, a frame for each face
    mjcf urdf     the model -> text that names mesh files
    sdf
    usd           the model -> text that holds the meshes
    check         what was written, as MuJoCo, yourdfpy and OpenUSD read it

Metres, kilograms, radians. The origin is that of the object frame, so that the frame of a
face is its `T_object_face`.
"""

ROBOT_FORMATS = ("mjcf", "urdf", "sdf", "usd")
