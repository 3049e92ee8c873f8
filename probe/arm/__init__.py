"""The five-axis arm of thesis 4.1: link table, forward, inverse, Jacobian."""
