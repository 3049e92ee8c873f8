"""Force on a tactel -> conductance -> voltage -> ADC counts, and back (Thesis 3.3, 4.2)."""
