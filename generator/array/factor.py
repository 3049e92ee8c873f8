"""Prime factors of q^n - 1, the number of terms of an m-sequence.

q = p^m splits as q^n - 1 = product of the cyclotomic values Phi_d(p), d | n m, so that
Pollard's rho meets only the primitive parts. Integers throughout; nothing is random.
The discrete logarithm of the decoder (Pohlig-Hellman) costs the square root of the
largest prime factor, hence `LARGEST_PRIME_FACTOR`.
"""

from __future__ import annotations

from functools import cache, lru_cache
from math import gcd, isqrt, prod

from generator.errors import ArrayError

LARGEST_PERIOD = 2**64 - 1  #: longest sequence, terms
LARGEST_PRIME_FACTOR = 2**40  #: of a group order: 2^20 baby steps, 16 MB of table

_WITNESSES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)  # prove primality below 3.18e23
_TRIAL_LIMIT = 1 << 10


def is_prime(number: int) -> bool:
    """Whether `number` (below 3.18e23) is prime: Miller-Rabin with a proven set of witnesses."""
    if number < 2:
        return False
    for witness in _WITNESSES:
        if number % witness == 0:
            return number == witness
    odd = number - 1
    twos = (odd & -odd).bit_length() - 1
    odd >>= twos
    for witness in _WITNESSES:
        power = pow(witness, odd, number)
        if power in (1, number - 1):
            continue
        for _ in range(twos - 1):
            power = power * power % number
            if power == number - 1:
                break
        else:
            return False
    return True


def prime_factors(number: int) -> dict[int, int]:
    """Return {prime: exponent} of a positive integer, in rising order of the primes."""
    found: dict[int, int] = {}
    divisor = 2
    while divisor < _TRIAL_LIMIT and divisor * divisor <= number:
        while number % divisor == 0:
            found[divisor] = found.get(divisor, 0) + 1
            number //= divisor
        divisor += 1 if divisor == 2 else 2
    pending = [number] if number > 1 else []
    while pending:
        part = pending.pop()
        if is_prime(part):
            found[part] = found.get(part, 0) + 1
        else:
            divisor = _proper_divisor(part)
            pending += [divisor, part // divisor]
    return dict(sorted(found.items()))


def _proper_divisor(composite: int) -> int:
    """Return a divisor of an odd composite by Pollard's rho in Brent's form."""
    root = isqrt(composite)
    if root * root == composite:
        return root
    for constant in range(1, composite):
        slow = fast = saved = 2
        length, divisor = 1, 1
        while divisor == 1:
            slow = fast
            for _ in range(length):
                fast = (fast * fast + constant) % composite
            done = 0
            while done < length and divisor == 1:
                saved, batch = fast, 1
                for _ in range(min(128, length - done)):
                    fast = (fast * fast + constant) % composite
                    batch = batch * (slow - fast) % composite
                divisor = gcd(batch, composite)
                done += 128
            length *= 2
        if divisor == composite:  # the batch swallowed both factors: repeat it one by one
            divisor = 1
            while divisor == 1:
                saved = (saved * saved + constant) % composite
                divisor = gcd(slow - saved, composite)
        if divisor != composite:
            return divisor
    raise AssertionError("a composite number has a proper divisor")


def prime_power(order: int) -> tuple[int, int]:
    """Return (p, m) with order = p^m; raises `ArrayError` if there is none."""
    factors = prime_factors(order) if order > 1 else {}
    if len(factors) != 1:
        around = range(max(2, order - 40), max(order, 2) + 41)
        powers = [q for q in around if len(prime_factors(q)) == 1]
        near = sorted(sorted(powers, key=lambda q: abs(q - order))[:4])
        raise ArrayError(
            f"no field has {order} elements: an order must be a prime power",
            fix=f"take one of {', '.join(map(str, near))}",
        )
    ((prime, exponent),) = factors.items()
    return prime, exponent


@cache
def _cyclotomic_value(index: int, argument: int) -> int:
    lower = (_cyclotomic_value(d, argument) for d in range(1, index) if index % d == 0)
    whole: int = argument**index - 1
    return whole // prod(lower)


@lru_cache(maxsize=512)
def _period_factors(order: int, degree: int) -> tuple[tuple[int, int], ...]:
    prime, exponent = prime_power(order)
    found: dict[int, int] = {}
    total = degree * exponent
    for index in range(1, total + 1):
        if total % index == 0:
            for factor, power in prime_factors(_cyclotomic_value(index, prime)).items():
                found[factor] = found.get(factor, 0) + power
    return tuple(sorted(found.items()))


def period_factors(order: int, degree: int) -> dict[int, int]:
    """Return {prime: exponent} of order^degree - 1 (at most 2^64 - 1)."""
    if degree < 1 or order**degree - 1 > LARGEST_PERIOD:
        longest = next(n for n in range(64, -1, -1) if order**n - 1 <= LARGEST_PERIOD)
        raise ArrayError(
            f"degree {degree} over GF({order}) is not allowed: the sequence has order^degree - 1 "
            f"terms, at most 2^64 - 1",
            fix=f"take a degree from 1 to {longest}",
        )
    return dict(_period_factors(order, degree))


def is_decodable(order: int, degree: int) -> bool:
    """Whether the discrete logarithm over GF(order^degree) stays within its tables."""
    return max(period_factors(order, degree), default=1) <= LARGEST_PRIME_FACTOR


def degrees_that_decode(order: int, degree: int) -> list[int]:
    """Return the nearest degrees, below and above, whose logarithm is feasible."""
    longest = next(n for n in range(64, 0, -1) if order**n - 1 <= LARGEST_PERIOD)
    below = next((n for n in range(degree - 1, 0, -1) if is_decodable(order, n)), None)
    above = next((n for n in range(degree + 1, longest + 1) if is_decodable(order, n)), None)
    return [n for n in (below, above) if n is not None]
