"""Kernels for the low frequencies of a sound before its attack."""

from __future__ import annotations

import numpy as np

from ._lane_kernels import exponentials, fused, logarithms, reordered

NOTHING = 1e-12  # of the sum of squares of a value that others predict


@reordered
def low_before(x, last, step, out):
    """out[i, k]: mean of x under a triangle that ends k steps before the sample last[i].

    Each reaches a step to either side of its greatest weight, 1; a row holds the latest first. NaN
    where samples before the first of x would be needed.
    """
    for i in range(len(out)):
        if last[i] - (out.shape[1] + 1) * step + 2 < 0:
            out[i] = np.nan
            continue
        for k in range(out.shape[1]):
            first = last[i] - (k + 2) * step + 2
            total = 0.0
            for j in range(step):
                total += (j + 1.0) * x[first + j]
            for j in range(step - 1):
                total += (step - 1.0 - j) * x[first + step + j]
            out[i, k] = total / step


@reordered
def predictors(rows, before, coefficients):
    """Coefficients that predict values by the ones before them, by lags, and of 1, the last.

    Values come the latest first; those from `before` on count, each row by its power there
    relative to 1. A coefficient is 0 where the others leave nothing to it.
    """
    order = len(coefficients) - 1
    count = rows.shape[1] - order - before
    sums = np.zeros((order + 2, order + 2))  # of products: the upper half
    for row in rows:
        power = 0.0
        for k in range(count):
            power += row[before + k] * row[before + k]
        weight = 1.0 / (power / count + 1.0)
        sums[order + 1, order + 1] += weight * count
        for i in range(order + 1):
            one, total = row[before + i : before + i + count], 0.0
            for k in range(count):
                total += one[k]
            sums[i, order + 1] += weight * total
            for j in range(i, order + 1):
                other, total = row[before + j : before + j + count], 0.0
                for k in range(count):
                    total += one[k] * other[k]
                sums[i, j] += weight * total
    least = np.empty(order + 2)
    for k in range(order + 2):
        least[k] = NOTHING * sums[k, k]
    for k in range(1, order + 2):
        for i in range(k + 1, order + 2):
            share = sums[k, i] / sums[k, k] if sums[k, k] > least[k] else 0.0
            sums[0, i] -= share * sums[0, k]
            for j in range(i, order + 2):
                sums[i, j] -= share * sums[k, j]
    for k in range(order + 1, 0, -1):
        for j in range(k + 1, order + 2):
            sums[0, k] -= sums[k, j] * coefficients[j - 1]
        coefficients[k - 1] = sums[0, k] / sums[k, k] if sums[k, k] > least[k] else 0.0


@fused
def begun_before(rows, before, coefficients, powers, evidence):
    """evidence[i, n]: logarithm of that of row i for a sound whose first n + 1 values rise above.

    With e the errors of prediction, m of them noise of an unknown variance, and n before the
    attack whose variance is p times that, each p in `powers` as likely as another,

        E = mean_p p^(-n/2) ((1 + c / p) / (1 + c))^(-(m + n) / 2),  c = sum_n e^2 / sum_m e^2.

    0 where there is no noise.
    """
    order = len(coefficients) - 1
    count = rows.shape[1] - order
    noise_count, errors = count - before, np.empty(count)
    inverse = np.concatenate((1.0 / powers, np.ones(1)))
    each, logs = np.uint64(len(inverse)), inverse.copy()
    logarithms(logs)
    ratio = np.empty(before * len(inverse))
    for i in range(len(rows)):
        noise = above = 0.0
        for k in range(count):
            error = rows[i, k] - coefficients[order]
            for j in range(order):
                error -= coefficients[j] * rows[i, k + 1 + j]
            errors[k] = error * error
            if k >= before:
                noise += errors[k]
        if not noise > 0.0:
            evidence[i] = 0.0
            continue
        for k in range(before):
            above += errors[k]
            for j in range(each):
                ratio[k * each + j] = 1.0 + above / noise * inverse[j]
        logarithms(ratio)
        for k in range(before):
            n, none = k + 1.0, ratio[(k + 1) * each - 1]
            for j in range(each):
                at = k * each + j
                ratio[at] = 0.5 * (n * logs[j] + (noise_count + n) * (none - ratio[at]))
        exponentials(ratio)
        for k in range(before):
            total = 0.0
            for j in range(each - 1):
                total += ratio[k * each + j]
            evidence[i, k] = total / (each - 1)
        logarithms(evidence[i])


@reordered
def likeliest_fractions(evidence, least, rounds, fraction):
    """Set the fractions of a mixture to the likeliest, and return by how much these gain.

    evidence[i, n] is the logarithm of the likelihood of row i if it is of kind n, 0 for the first.
    So many rounds of expectation and maximisation begin with the given fractions; the gain is that
    of the log-likelihood over a fraction of 1 for the first kind, and 0 if each other one would
    make it less, or if no fractions gain more than `least`.
    """
    count, kinds = evidence.shape
    odds, most = np.empty((count, kinds)), 0.0
    for i in range(count):
        greatest = evidence[i].max()
        most += greatest
        for n in range(kinds):
            odds[i, n] = evidence[i, n] - greatest
    if most <= least:
        return 0.0
    total, gain = np.zeros(kinds), 0.0
    for i in range(count):
        exponentials(odds[i])
        for n in range(kinds):
            total[n] += odds[i, n] / odds[i, 0]
    if total.max() <= count:
        return 0.0
    for _ in range(rounds):
        total[:] = 0.0
        for i in range(count):
            likely = 0.0
            for n in range(kinds):
                likely += fraction[n] * odds[i, n]
            for n in range(kinds):
                total[n] += odds[i, n] / likely
        for n in range(kinds):
            fraction[n] *= total[n] / count
    for i in range(count):
        likely = 0.0
        for n in range(kinds):
            likely += fraction[n] * odds[i, n]
        gain += np.log(likely / odds[i, 0])
    return gain
