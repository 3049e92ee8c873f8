"""How a part was printed, from 25-50 touches of it.

touches     recording -> strain and stroke width of the print under each touch
estimate    touches -> `AsBuilt` of parts and of a printer, stored; corrects every later pose
verdict     the verdict on a print, as text and JSON
"""
