"""The five-axis manipulator that carries the probe. Thesis 4.1.

    links         the link table: joint angles -> pose of the gripper
    inverse       pose -> joint angles, every branch
    jacobian      speeds, and joint speeds that stay bounded near singularities
    carried       joint angles and wrist -> pose of the sensor, with its covariance

mm, rad. Poses are 4x4, `T_base_gripper` and `T_base_sensor`; base frame: z up, along the
first joint's axis.
"""
