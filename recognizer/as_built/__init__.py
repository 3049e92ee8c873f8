"""How a part came out of the printer, from 25-50 touches of it.

::

    touches     recording -> for every touch how the print under it is stretched
    estimate    many touches of a part -> its scale both ways, skew, stroke width; of a printer
    verdict     what a person does about it
    parts       every part of an object with its verdict;  words  the same in words and as JSON
    settings    every number that decides

The estimate is a `generator.database.as_built.AsBuilt`; `recognizer.touch.as_built` is what every
later pose does with it.
"""
