"""Kernels for attack and peak of an impact in sound: where the variance of innovations changes."""

from __future__ import annotations

import numpy as np

from ._lane_kernels import (
    exponentials,
    fused,
    logarithms,
    reordered,
    sum_of,
    sum_of_products,
    sum_of_squares,
)

DEPENDENT = 0.9  # times how many dependent squares hold what one independent one does
MOST_TOGETHER, JUMP = 0.6, 5.0  # power of dependent ones, at most, and jump [neper] that halves it
SURE = 0.7  # of the standard error expected for a rise: the least one of an attack
CLEAR = 0.03  # fraction of the greatest power above which a sound is not a filter's ringing


@fused
def measure(x, places, limits, scale, out, sounds):
    """Attack and peak of the impacts at `places`, and the sound around each.

    Parameters
    ----------
    x : samples from well before the first place to well after the last, or all that there are
    places : (n,) first samples of the frames that hold the crests, as indices of x
    limits : least and greatest sample of the record
    out : (n, 5), room for attack (index in x, between samples), peak, whether it is clipped, the
        variance of the attack and the samples from there until the sound is clear
    sounds : (n, m), output for the sound around each attack; zeros where that is incomplete
    """
    gains = np.empty((2, 3, 2 * scale.reach + 1))
    for found in range(len(places)):
        split, out[found, 3] = attack(x, places[found], scale, gains)
        out[found, 0] = split - 0.5
        out[found, 1], out[found, 2] = crest(x, split, limits, scale)
        out[found, 4] = clear_after(x, split, scale)
        begin_sound = split - scale.before
        earliest = scale.short_lag + scale.slope
        if begin_sound < earliest or begin_sound + sounds.shape[1] > len(x):
            sounds[found] = 0.0
        else:
            innovations(x, begin_sound, scale.short_lag, scale.slope, sounds[found])


@fused
def attack(x, at, scale, gains):
    """First sample after the greatest change of variance near `at`, with its variance.

    Of the innovations over the short and the long lag, those whose change is the more likely
    count: room noise is weakest in the former, white noise in the latter. `at` itself where the
    variance rises in neither. `gains` is scratch of (2, 3, 2 reach + 1).

    The variance is that of the probability of all splits within reach, and of the place between
    two samples; and no less than such a rise has on the mean.
    """
    first = max(at - scale.past * scale.hop, scale.long_lag + scale.slope)
    last = min(at + scale.forward * scale.hop, len(x))
    squares = np.empty((2, max(last - first, 0)))
    best, split, gain = 0, at - first, -1.0
    for k in range(1 + (scale.long_lag > scale.short_lag)):  # at 8 kHz they are one
        lag = scale.short_lag if k == 0 else scale.long_lag
        innovations(x, first, lag, scale.slope, squares[k])
        square(squares[k])
        place, gained = variance_change(squares[k], at - first, scale.reach, gains[k])
        if k == 0 or gained > gain:
            best, split, gain = k, place, gained
    dense = max(0.5 * scale.short_lag, 1.0)
    together = counting_as_one(squares[best], split, gain, 3 * scale.slope // 2, dense)
    earliest = at - first - scale.reach
    variance = split_variance(gains[best, 0], earliest, split, 2.0 * together, gains[0, 1])
    least = SURE * min(
        samples_that_tell(squares[best], split, together), scale.reach / np.sqrt(3.0)
    )
    return first + split, max(variance, least * least)


@fused
def counting_as_one(squares, split, gain, lags, dense):
    """Number of dependent squares that count as one where their mean changes by `gain`.

    A weak rise shows in the mean of many: 1 + 2 sum r of them count as nearly one, r their
    correlation at each lag before and after the split. A strong one shows in a single square, or in
    as many as are `dense`: above 48 kHz a sound changes little from one to the next.
    """
    away = np.zeros(len(squares) + 2 * lags)  # with zeros behind each side of the split
    for first, last, at in ((0, split, 0), (split, len(squares), split + lags)):
        part, own = squares[first:last], away[at : at + last - first]
        mean = sum_of(part) / max(last - first, 1)
        for i in range(np.uint64(len(part) if mean > 0.0 else 0)):
            own[i] = part[i] / mean - 1.0
    alone, together = sum_of_squares(away), 1.0
    if not alone > 0.0:
        return DEPENDENT * dense
    for lag in range(1, lags + 1):
        shared = sum_of_products(away[: len(away) - lag], away[lag:])
        together += 2.0 * max(shared / alone, 0.0)
    jump = 2.0 * max(gain, 0.0) / len(squares)  # logarithm of the variance after over that before
    power = MOST_TOGETHER / (1.0 + (jump / JUMP) ** 4)
    return DEPENDENT * dense * max(together / dense, 1.0) ** power


@fused
def samples_that_tell(squares, split, together):
    """Squares before the split that make it e times less likely, on the mean; inf for no rise.

    Of independent ones whose mean rises by r at the split, each contributes (ln r - 1 + 1/r) / 2.
    The split is not known better than this, even if a single large square seems to show it.
    """
    before = sum_of(squares[:split]) / max(split, 1)
    after = sum_of(squares[split:]) / max(len(squares) - split, 1)
    if not after > before:
        return np.inf
    rise = after / before if before > 1e-30 * after else 1e30
    told = 0.5 * (np.log(rise) - 1.0 + 1.0 / rise)
    return together / told if told > 0.0 else np.inf


@reordered
def split_variance(gains, first, split, together, weights):
    """Variance of the split about `split`, with probability exp(gain / together).

    gains[i] is that of first + i, less than 0 where it is none. All are as likely if all are none.
    `weights` is scratch.
    """
    greatest = gains.max()
    if greatest < 0.0:
        return (len(gains) // 2) ** 2 / 3.0
    for i in range(np.uint64(len(gains))):
        weights[i] = (gains[i] - greatest) / together
    exponentials(weights)
    total = second = 0.0
    for i in range(np.uint64(len(gains))):
        weight = weights[i] if gains[i] >= 0.0 else 0.0
        away = np.float64(np.int64(i) + first - split)
        total += weight
        second += weight * away * away
    return second / total + 1.0 / 12.0


@fused
def clear_after(x, split, scale):
    """Samples after the attack until innovations reach CLEAR of their greatest power.

    It is 0 where a sound begins at once, and not where a filter rings before it.
    """
    first = max(split, scale.short_lag + scale.slope)
    count = min(scale.reach, len(x) - first)
    if count < 2:
        return 0
    values = np.empty(count)
    innovations(x, first, scale.short_lag, scale.slope, values)
    square(values)
    greatest = 0.0
    for k in range(count - 1):
        greatest = max(greatest, values[k] + values[k + 1])
    k = 0
    while values[k] + values[k + 1] < CLEAR * greatest:
        k += 1
    return k


@fused
def innovations(x, first, lag, slope, out):
    """Residuals of linear extrapolation from two earlier samples.

    y[i] = x[i] - x[i - lag] - lag / slope (x[i - lag] - x[i - lag - slope]): hum is straight.
    """
    share, count = lag / slope, np.uint64(len(out))
    now, then, before = np.uint64(first), np.uint64(first - lag), np.uint64(first - lag - slope)
    for k in range(count):
        out[k] = x[now + k] - (1.0 + share) * x[then + k] + share * x[before + k]


@fused
def square(values):
    """Square them, in place."""
    for k in range(len(values)):
        values[k] *= values[k]


@fused
def variance_change(squares, at, reach, gains):
    """The split of N squares near `at` at which their variance changes most [Maeda1985]_.

    It minimises AIC(k) = k ln mean(squares[:k]) + (N - k) ln mean(squares[k:]). Returns the split
    and the gain N ln mean(squares) - AIC; (at, -1) if the mean rises nowhere. The gain of every
    split at - reach + i is stored in gains[0, i], -1 where the mean does not rise; the other two
    rows are scratch.
    """
    count, total = len(squares), sum_of(squares)
    gains[0] = -1.0
    mean, least = total / count, 1e-12 * total / count
    split, gain = at, -1.0
    begin, end = max(at - reach, 1), min(count, at + reach + 1)
    if begin >= end or not mean > 0.0:
        return split, gain
    low, high = begin - at + reach, end - at + reach
    of, before, after = gains[0][low:high], gains[1][low:high], gains[2][low:high]
    near = np.uint64(len(of))
    head = sum_of(squares[: begin - 1])
    for k in range(begin, end):
        head += squares[k - 1]
        before[k - begin] = head
    for i in range(near):  # in vector lanes, as what follows
        k = np.float64(begin) + np.float64(i)
        earlier, later = before[i] / k, (total - before[i]) / (count - k)
        earlier = earlier if earlier > least else least
        later = later if later > least else least
        of[i] = 0.0 if later > earlier else -1.0
        before[i], after[i] = earlier / mean, later / mean
    logarithms(before)
    logarithms(after)
    for i in range(near):
        k = np.float64(begin) + np.float64(i)
        gained = -k * before[i] - (count - k) * after[i]
        if of[i] == 0.0:
            of[i] = max(gained, 0.0)
            if gained > gain:
                split, gain = begin + np.int64(i), gained
    return split, gain


@fused
def crest(x, split, limits, scale):
    """Greatest deviation after the attack from the mean before; 1.0 as flag if clipped.

    It is clipped if two samples in a row lie at the least or greatest sample of the record.
    """
    i0 = max(split - scale.past * scale.hop, 0)
    base = sum_of(x[i0:split]) / max(split - i0, 1)
    sound = x[split : split + scale.forward * scale.hop]
    greatest, extreme, clipped = 0.0, 0, 0.0
    for i in range(np.uint64(len(sound))):
        away = abs(sound[i] - base)
        greatest = away if away > greatest else greatest
        extreme += (sound[i] <= limits[0]) | (sound[i] >= limits[1])
    before = False
    for i in range(len(sound) if extreme > 1 else 0):
        now = sound[i] <= limits[0] or sound[i] >= limits[1]
        if now and before:
            clipped = 1.0
        before = now
    return greatest, clipped


@fused
def crests_after(x, attacks, limits, scale, out):
    """out[k]: `crest` after attack k, a place between samples of x."""
    for k in range(len(attacks)):
        split = int(attacks[k] + 0.5)
        out[k, 0], out[k, 1] = crest(x, split, limits, scale)
