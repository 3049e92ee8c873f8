"""Simulated touches of registered faces and of written parts."""
