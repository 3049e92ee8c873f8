"""What decides between an answer and none by maximum likelihood: every number in one place.

Probabilities, and log-likelihoods in nats.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LikelihoodSettings:
    """Defaults of `decode_likelihood`, and how wide the search is."""

    doubt: float = 5e-4
    """Largest probability of a wrong answer that is still given."""
    blank: float = 0.01
    """Probability that a window shows no code at all."""
    symbol_error: float = 0.05
    """Probability that a symbol is read wrong, where no scores say so."""
    listed: int = 16
    """Candidates that are listed if nothing is answered."""
    far: float = 7.0
    """Below the best: no candidate any more (odds of 1 to 1,100)."""
    negligible: float = 30.0
    """Below the best: no weight left (e^-30 = 1e-13) in a sum."""
    tries: int = 4
    """Orders of reliability that ordered statistics decode in."""
    kept: int = 6
    """Best places of each try that are weighed against each other."""
    jitter: float = 0.6
    """Spread of the shuffles between tries, as a share of the reliability."""


LIKELIHOOD = LikelihoodSettings()
