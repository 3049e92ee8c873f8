"""Frame -> object, face, pose: the reading side, thesis 4.3, 6 and appendix 3."""
