"""Window -> index: the code conversions of thesis 5.1, 5.4.3 and appendix 5."""
