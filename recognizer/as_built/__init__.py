"""How a part was printed, from 25-50 touches of it.

touches     recording -> strain and stroke width of the print under each touch
estimate    touches -> scale both ways, skew, stroke width of parts and of a printer; stores them
verdict     the verdict on a print, as text and JSON

The estimate is a `generator.database.as_built.AsBuilt`; `recognizer.touch.as_built` corrects every
later pose with it.
"""
