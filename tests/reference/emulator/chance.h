/* Random numbers from a stated seed, so that a run can be repeated. */
#ifndef CHANCE_H
#define CHANCE_H

#include <math.h>
#include <stdint.h>

typedef struct {
    uint64_t state; /* never 0 */
} chance_t;

/* Marsaglia's xorshift with a multiplication on the way out (Vigna 2016). */
static inline uint64_t chance_bits(chance_t *chance)
{
    chance->state ^= chance->state >> 12;
    chance->state ^= chance->state << 25;
    chance->state ^= chance->state >> 27;
    return chance->state * 0x2545F4914F6CDD1DULL;
}

/* The seed is spread by one step of splitmix, so that neighbouring seeds give unlike numbers. */
static inline chance_t chance_from(uint64_t seed)
{
    uint64_t z = seed + 0x9E3779B97F4A7C15ULL;

    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    z ^= z >> 31;
    return (chance_t){z ? z : 1};
}

/* Uniform, 0 < u < 1. */
static inline double chance_uniform(chance_t *chance)
{
    return ((double)(chance_bits(chance) >> 11) + 0.5) / 9007199254740992.0;
}

/* Normal, mean 0, deviation 1 (Box and Muller). */
static inline double chance_normal(chance_t *chance)
{
    double radius = sqrt(-2 * log(chance_uniform(chance)));

    return radius * cos(2 * M_PI * chance_uniform(chance));
}

#endif
