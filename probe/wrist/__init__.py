"""The instrumented passive compliant wrist: four distances -> where the probe hangs. Thesis 4.1.

Two plates; the upper one is fixed to the gripper, the lower one carries the probe. Springs
give the lower plate three freedoms, a displacement along z and two turns; transducers measure
the distances AA', BB', CC', DD' between the plates at the corners of a parallelogram.

    geometry      the wrist, its frames and transforms
    distances     four distances -> pose with its covariance, and back
    springs       forces -> pose, stiffness for the contact models
"""
