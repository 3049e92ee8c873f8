"""Touch -> frame: the tactile probe of thesis 4.1 and 4.2, real and simulated."""
