"""`python -m generator.command`: `encode-object`, where its script is not at hand."""

from generator.command import main

main()
