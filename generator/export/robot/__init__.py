"""What robots and simulators load: MJCF, URDF, SDF and USD of an object as one rigid body."""
