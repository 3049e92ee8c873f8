"""The closed loop: touches of written parts, simulated, read, and compared with the truth."""
