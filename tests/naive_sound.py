"""Slow, readable twin of the sound detector, on a whole record at once."""

from __future__ import annotations

import itertools

import numpy as np

SMOOTH = np.array([-1, 2, 6, 2, -1]) / 8  # LeGall 5/3, the filters that its lifting steps amount to
DETAIL = np.array([-1, 2, -1]) / 2


def extended(x, hop, frames=40):
    """Whole hops of x, with its first and last sample going on beyond its ends."""
    more = frames * hop
    return np.concatenate((np.full(more, x[0]), x, np.full(more + -len(x) % hop, x[-1]))), frames


def octave_powers(x, octaves):
    """Mean square of the details of each octave (rows) in each frame of 2**octaves samples."""
    frames = len(x) // 2**octaves
    rows = []
    for _ in range(octaves):
        # Row i of each: the filter about sample 2 i (smooth) or 2 i + 1 (detail).
        detail = np.convolve(np.append(x, x[-1]), DETAIL, mode="valid")[::2]
        detail = np.append(detail, np.zeros(len(x) // 2 - len(detail)))
        rows.append((detail**2).reshape(frames, -1).mean(axis=1))
        x = np.convolve(np.pad(x, 2, mode="edge"), SMOOTH, mode="valid")[::2]
    return np.array(rows)


def quantile_power(powers, freedom):
    """Noise power (Gaussian) whose means of `freedom` squares lie below the lowest tenth's edge."""
    tenth = np.sort(powers)[int(0.1 * len(powers))]
    return tenth / (1 - 2 / (9 * freedom) - 1.2815515655446004 * np.sqrt(2 / (9 * freedom))) ** 3


def windows_of(count, size, blocks):
    """For each window of `size` frames its blocks of 128: [first, last) and those within reach."""
    for begin in range(0, count, size):
        first, last = begin // 128, -(-min(begin + size, count) // 128)
        yield first, last, max(first - blocks, 0), last + blocks


def octave_rise(x, scale, rate, size=4096):
    """C of each frame of the record and the loudness after it, without digital silence."""
    hop, octaves = scale.hop, scale.octaves
    whole, more = extended(x, hop, 80)
    power = octave_powers(whole, octaves)
    count = -(-len(x) // hop)
    real = len(x) // hop - 4
    block = 128 * hop / rate
    weights = 2.0 ** (-np.arange(octaves) / 2)
    weights /= weights.sum()
    after, before = np.zeros((octaves, count)), np.zeros((octaves, count))
    falling = np.arange(scale.forward, 0, -1) / np.arange(scale.forward, 0, -1).sum()
    for j in range(count):
        after[:, j] = power[:, more + j : more + j + scale.forward] @ falling
        before[:, j] = power[:, more + j - scale.past : more + j].mean(axis=1)
    groups = 2 * -(-count // 16)
    parts = power[:, more : more + 8 * groups].reshape(octaves, groups, 8).mean(axis=2)
    sure = np.array([8 * g >= 4 and 8 * g + 8 <= real for g in range(groups)])
    filled = np.pad(parts, ((0, 0), (0, -groups % 16)))
    means = filled.reshape(octaves, -1, 16).mean(axis=2)
    c, loud = np.zeros(count), np.zeros(count)
    for first, last, low, high in windows_of(count, size, round(4 / block)):
        for b in range(octaves):
            inside = np.flatnonzero(sure[16 * low : 16 * high]) + 16 * low
            noise = quantile_power(parts[b, inside], 8 * hop / 2 ** (b + 1))
            for g in range(first, last):
                near = round(1 / block)
                strongest = means[b, max(g - near, 0) : g + near + 1].max()
                background = max(noise, 1e-4 * strongest)
                for j in range(128 * g, min(128 * g + 128, count)):
                    ratio = after[b, j] / max(before[b, j], 2 * background)
                    c[j] += weights[b] * max(0.0, np.log(ratio))
                    loud[j] += weights[b] * max(0.0, np.log(after[b, j] / (2 * background)))
    c[: scale.past] = 0
    c[real - scale.forward :] = 0
    return c, loud


def beyond_tails(place, loud, frame):
    """By how much each crest is louder than the tails of those before it."""
    strong = [j for j in place if loud[j] > 0.7]
    rates = []
    for j, following in itertools.pairwise([*strong, -(-len(loud) // 16) * 16]):
        end = min(j + 0.06 / frame, following - 0.006 / frame) // 16 * 16
        after = [i for i in range(0, len(loud), 16) if j + 0.007 / frame <= i < end]
        if after:
            heard = [i for i in after if loud[i] > 0.1]
            left = np.mean(loud[heard]) if heard else 0.0
            rates.append((loud[j] - left) / frame / (np.mean(heard or after[:1]) - j))
    if len(rates) < 3:
        return dict.fromkeys(place, np.inf)
    rate = np.median(rates)
    tails = [loud[place[:k]] - rate * frame * (j - place[:k]) for k, j in enumerate(place)]
    return {j: loud[j] - tail.max(initial=-np.inf) for j, tail in zip(place, tails, strict=True)}


def band_powers(x, rate, hop, bands):
    """Power of each band (rows) in windows centred on every `hop`-th sample."""
    size = len(bands.window)
    hann = np.sin(np.pi * np.arange(size) / size) ** 2
    frames = -(-len(x) // hop)
    more = np.concatenate((np.full(size, x[0]), x, np.full(size + hop, x[-1])))
    triangles = []
    centre, step = [30.0], rate / size
    while (upper := max(centre[-1] * 2 ** (1 / 24), centre[-1] + step)) <= min(17e3, 0.5 * rate):
        centre.append(upper)
    for low, middle, high in zip(centre, centre[1:], centre[2:], strict=False):
        frequency = step * np.arange(size // 2 + 1)
        triangles.append(np.interp(frequency, [low, middle, high], [0, 1, 0]))
    power = np.empty((len(triangles), frames))
    for i in range(frames):
        piece = more[size + i * hop - size // 2 :][:size]
        piece = piece - np.sum(hann * piece) / hann.sum()
        power[:, i] = np.array(triangles) @ np.abs(np.fft.rfft(hann * piece)) ** 2
    return power


def band_rise(x, rate, hop, bands, freedom, lag, size=256):
    """B and G of each frame, without digital silence; `freedom` of a mean and of one frame."""
    power = band_powers(x, rate, hop, bands)
    count, half = power.shape[1], len(bands.window) // 2
    centre = hop * np.arange(count)
    heard = (centre >= half) & (centre + half <= len(x))
    block = 8 * hop / rate
    blocks = -(-count // 8)
    means = np.zeros((len(power), blocks))
    for g in range(blocks):
        inside = [k for k in range(8 * g, min(8 * g + 8, count)) if heard[k]]
        means[:, g] = power[:, inside or slice(8 * g, 8 * g + 8)].mean(axis=1)
    sounding = np.array([heard[8 * g : 8 * g + 8].any() for g in range(blocks)])
    rise, likelihood = np.zeros(count), np.zeros(count)
    for first, last, low, high in windows_of(16 * count, 16 * size, round(4 / block)):
        inside = np.flatnonzero(sounding[low:high]) + low
        noise = np.array(
            [quantile_power(row[inside], n) for row, n in zip(means, freedom[0], strict=True)]
        )
        for g in range(first, last):
            near = round(1 / block)
            strongest = means[:, max(g - near, 0) : g + near + 1].max(axis=1)
            background = np.maximum(noise, 1e-4 * strongest)
            least = 2 * background
            for i in range(8 * g, min(8 * g + 8, count)):
                before = power[:, max(i - lag, 0)]
                more = np.maximum(power[:, i] / np.maximum(before / 2, background), 1.0)
                likelihood[i] = np.max(freedom[1] / 2 * (more - 1 - np.log(more)))
                then = np.pad(before, 1)
                widest = np.maximum(np.maximum(then[:-2], then[1:-1]), then[2:])
                ratio = np.maximum(power[:, i], least) / np.maximum(widest, least)
                rise[i] = np.maximum(0, np.log(ratio)).mean()
    known = heard & (np.arange(count) >= lag - (-half // hop))
    return np.where(known, rise, 0.0), np.where(known, likelihood, 0.0), known


def rise_likelihood(x, scale, rate, heard, size=4096):
    """H of every fourth frame, without digital silence; `heard` says where narrow bands are."""
    hop, count = scale.hop, -(-len(x) // scale.hop)
    whole, more = extended(x, hop, 80)
    real = len(x) // hop - 4
    blocks, block = -(-count // 128), 128 * hop / rate
    near = round(1 / block)
    out = np.where(np.arange(4 * -(-count // 16)) < -(-count // 4), 3.0, 0.0)
    for k in range(scale.octaves + 3):
        detail = np.convolve(np.append(whole, whole[-1]), DETAIL, mode="valid")[::2]
        detail = np.append(detail, np.zeros(len(whole) // 2 - len(detail)))
        whole = np.convolve(np.pad(whole, 2, mode="edge"), SMOOTH, mode="valid")[::2]
        low = k >= scale.octaves
        per = max(hop // 2 ** (k + 1), 1)  # coefficients that make one power
        frames = max(2 ** (k + 1) // hop, 1)  # that it lasts
        power = (detail[: len(detail) // per * per] ** 2).reshape(-1, per).mean(axis=1)
        begin = more // frames
        width = max(round(scale.forward / frames), 4) if low else scale.forward
        falling = np.arange(width, 0, -1) / np.arange(width, 0, -1).sum()

        def mean(first, last, power=power, begin=begin, frames=frames):
            return power[begin + first // frames : begin + last // frames].mean()

        parts = np.array([mean(32 * g, 32 * g + 32) for g in range(-(-count // 32))])
        if low:
            sure = [heard[2 * g : 2 * g + 2].all() for g in range(len(parts))]
            sure = np.pad(np.array(sure) & (2 * np.arange(len(parts)) + 1 < len(heard)), (0, 4))
            known = [np.flatnonzero(sure[4 * g : 4 * g + 4]) + 4 * g for g in range(blocks)]
            means = [
                parts[i].mean() if len(i) else parts[4 * g : 4 * g + 4].mean()
                for g, i in enumerate(known)
            ]
            samples = [(g, means[g]) for g in range(blocks) if heard[8 * g : 8 * g + 8].any()]
            freedom = 128 / frames
        else:
            short = np.array([mean(8 * g, 8 * g + 8) for g in range(2 * -(-count // 16))])
            means = np.pad(short, (0, -len(short) % 16)).reshape(-1, 16).mean(axis=1)
            sure = [8 * g >= 4 and 8 * g + 8 <= real for g in range(len(short))]
            samples = [(g // 16, short[g]) for g in np.flatnonzero(sure)]
            freedom = 8 * hop / 2 ** (k + 1)
        half = 0.75 * per * width * (width + 1) / (2 * width + 1)
        for first, last, lowest, highest in windows_of(count, size, round(4 / block)):
            noise = quantile_power([v for g, v in samples if lowest <= g < highest], freedom)
            for g in range(first, last):
                about = [parts[min(max(4 * g - 6 + i, 0), len(parts) - 1)] for i in range(16)]
                usual = np.sort(about)[8] / (1 - 2 / (9 * 32 * per / frames)) ** 3
                strongest = max(means[max(g - near, 0) : g + near + 1])
                for j in range(128 * g, min(128 * g + 128, count), 4):
                    at = begin + j // frames
                    before = power[at - width : at].mean()
                    ratio = power[at : at + width] @ falling
                    ratio /= max(before, noise, 1e-4 * strongest, usual)
                    if ratio > 1:
                        out[j // 4] = max(out[j // 4], half * (ratio - 1 - np.log(ratio)))
    return out


def by_rises(judged, c, h, b, known, spread, frame):
    """Probabilities of crests by H as well, and those of crests of H, by frame."""
    reach, second = round(0.008 / frame / 4), round(1 / frame / 16)
    odds = {j: np.log(p / (1 - p)) if p < 1 else 50 for j, p in judged.items()}
    group = {j: min(round(j / 16), len(b) - 1) for j in odds}
    close = round(0.005 / frame / 4)
    here = {j: h[max(j // 4 - close, 0) : j // 4 + close + 1].max() for j in odds}
    evident = {j for j in odds if odds[j] > 1 and (here[j] > 20 or not known[group[j]])}
    duration = len(b) * 16 * frame + 10
    turned = {}
    for j, x in odds.items():
        turned[j] = x
        if x <= -2 or not known[group[j]] or c[j] > max(1.65, 10 * spread):
            continue
        often = 1 / 60 + len(evident - {j}) / duration
        rise = b[max(group[j] - 2, 0) : group[j] + 3].max()
        if here[j] < 12:
            least = 4 if rise >= 0.33 else 1
            turned[j] = min(x, x + 1.5 * np.log((1 + here[j]) * min(often, 1) / least))
    alone = [i for i in crests(h, reach) if h[i] > 6.4]
    often = 1 / 60 + len(evident) / duration
    for i in alone:
        g = min(round(i / 4), len(b) - 1)
        near = [j for j in odds if -0.01 / frame <= j - 4 * i < 0.01 / frame]
        if h[i] <= 16 or any(odds[j] > 0 for j in near) or not known[g]:
            continue
        number = sum(abs(j - i) <= int(0.05 / frame / 4) and h[j] > 0.4 * h[i] for j in alone)
        before = h[max(i - round(0.1 / frame / 4), 0) : i - round(0.006 / frame / 4) + 1].max()
        x = 0.31 * np.log(1 + h[i]) - 0.81 * number + 1.51 * np.log(often) + 0.7
        x -= 2.43 * np.log(max(b[max(g - second, 0) : g + second + 1].max(), 0.33))
        x = min(x, (h[i] - 16) / 3, 3 * np.log(h[i] / (0.3 * before)))
        x -= np.log(1 + rattle_near(c, 4 * i, frame) / (spread * (1.9 + 9 * spread)))
        best = max(near, key=lambda j: turned[j], default=4 * i)
        best = best if turned.get(best, -np.inf) > -2 else 4 * i
        turned[best] = max(x, turned.get(best, -np.inf))
    return {j: 1 / (1 + np.exp(-x)) for j, x in turned.items()}


def rattle_near(c, j, frame):
    """The rattle about frame j, without digital silence."""
    reach, g = round(1 / (128 * frame)), j // 128
    sample = np.sort(c[128 * max(g - reach, 0) : 128 * (g + reach + 1) : 16])
    return max(50 * sample[int(0.75 * len(sample))], 12 * sample[int(0.9 * len(sample))])


def crests(values, spacing):
    """Frames that no frame within `spacing` exceeds, nor equals before."""
    padded = np.pad(values, spacing)
    found = []
    for j in np.flatnonzero(values > 0):
        near = padded[j : j + 2 * spacing + 1]
        if near[:spacing].max() < values[j] >= near[spacing:].max():
            found.append(j)
    return np.array(found)


def as_high(c, place, j, reach, share):
    """How many other crests of C about frame j are higher than a share of it."""
    near = place[(np.abs(place - j) <= int(reach)) & (place != j)]
    return np.count_nonzero(c[near] > share * c[j])


def dense_odds(c, place, j, above, a, frame):
    """Log-odds of a crest among 30 others a second about as high, and few in between."""
    loudest = c[place[(place >= j - 1 / frame) & (place < j + 1 / frame)]].max()
    high, lower = (as_high(c, place, j, 1 / frame, share) for share in (0.4, 0.13))
    if high < 60 or c[j] < 0.3 * loudest:
        return -np.inf
    by_heights = 3 - 15 * (lower - high) / high
    return min(by_heights, 6.5 * np.log(max(above, c[j] / 1.5) / (2 * a)))


def pulse_odds(x, c, b, place, j, frame):
    """Log-odds x of a crest that may be a pulse of a voice: a crowd that does not last."""
    number = as_high(c, place, j, 0.05 / frame, 0.4)
    pace = []
    for reach in (0.05 / frame, 1 / frame):
        time = min(j + reach, 16 * len(b)) - max(j - reach, 0)
        pace.append((as_high(c, place, j, reach, 0.4) + 1) / time)
    if number < 5 or pace[1] >= 0.7 * pace[0]:
        return x
    i = min(round(j / 16), len(b) - 1)
    bands = min(max(b[max(i - 2, 0) : i + 3].max(), 0.01), 0.33)
    return min(x, 0.3 * x - 0.76 * number + 6.1 + 1.69 * np.log(bands))


def probability(c, loud, b, likelihood, known, spacing, spread, rate, hop, growth=None):
    """Of crests of C (and of B where there is none of C), by frame."""
    growth = np.zeros(len(b)) if growth is None else growth
    frame = hop / rate
    place = crests(c, spacing)
    place = place[c[place] >= 0.5 * spread]
    beyond = beyond_tails(place, loud, frame)
    octaves, bands, others, dense, risen = {}, {}, {}, {}, {}
    for j in place:
        i = min(round(j / 16), len(b) - 1)
        around = b[max(i - round(0.15 / frame / 16), 0) : i + round(0.05 / frame / 16) + 1].mean()
        near = slice(max(i - 2, 0), i + 3)
        bound = b[near].max() / max(0.035, around) if known[i] else np.inf
        rattle = rattle_near(c, j, frame)
        a = spread * (1.9 + 9 * spread)
        around = np.sort(c[place[(place >= j - 1 / frame) & (place < j + 1 / frame)]])
        crowd = around[-80] if len(around) >= 80 else 0.0
        least = min(4 * a, 0.3 * around[-1] + 0.1 * rattle)
        rattle = min(rattle, max(least, 50 * (crowd - 0.75 * spread)))
        beside = place[(place >= j - 0.028 / frame) & (place < j + 0.028 / frame)]
        certain = likelihood[near].max() / 36 if known[i] and c[j] == c[beside].max() else 0.0
        above = min(c[j], max(beyond[j], 0))
        octaves[int(j)] = min(above / (a + rattle) + certain, above / (0.25 * a + rattle), bound)
        bands[int(j)] = c[j] / max(1.65, 10 * spread)
        dense[int(j)] = dense_odds(c, place, j, above, a, frame)
        shortly = np.sort(c[place[(place >= j - 0.25 / frame) & (place < j + 0.25 / frame)]])
        briefly = shortly[-20] if len(shortly) >= 20 else 0.0
        strong = np.sum(around > 2 * a) - (c[j] > 2 * a)
        second = place[(place >= j - 1 / frame) & (place < j + 1 / frame)]
        frames = np.minimum(np.round(second / 16).astype(int), len(b) - 1)
        rises = [b[max(k - 2, 0) : k + 3].max() for k in frames]
        beside = c[place[(place >= j - 0.04 / frame) & (place < j + 0.04 / frame)]].max()
        clear = likelihood[near].max() if known[i] else np.inf
        others[int(j)] = (
            0.6 * np.log(max(36 * certain, 1))
            + 1.9 * np.log(strong / 2 + 0.5)
            - 1.1 * np.log(max(max(rises), 0.01))
            - 1.3 * np.log(max(crowd / a, 0.05) * max(briefly / a, 0.05))
            - 7.3,
            6.5 * np.log(max(min(bound, clear / 7, above / max(0.35 * a, 0.1 * beside)), 1e-9)),
        )
    last = -np.inf
    reach = round(0.025 / frame / 16)
    for i in range(len(b)):
        if b[i] == 0 or b[i] < b[max(i - reach, 0) : i + reach + 1].max() or i - last <= reach:
            continue
        last = i
        beside = [j for j in place if -0.012 / frame <= j - 16 * i < 0.02 / frame]
        best = int(max(beside, key=lambda j: c[j]) if beside else 16 * i)
        bands[best] = max(bands.get(best, 0.0), b[i] / 0.33)
        risen[best] = max(risen.get(best, 0.0), b[i] / 0.33)
    evident = {j for j, e in octaves.items() if 1 <= e < 2}
    found = {}
    for j, by_bands in bands.items():
        often = 1 / 60 + len(evident - {j}) / (len(b) * 16 * frame + 10)
        by_octaves = max(octaves.get(j, 0.0), 1e-9)
        odds = [6.5 * np.log(by_octaves) + 1.5 * np.log(often) + 3]
        i = min(round(j / 16), len(b) - 1)
        strongest = max(range(max(i - 2, 0), min(i + 3, len(b))), key=lambda k: b[k])
        grows = growth[strongest] > 0.6 and not (j in others and c[j] >= 2 * a)
        steep = 0.0 if grows else by_bands
        odds.append((7 if steep < 1 else 3) * np.log(max(steep, 1e-9)))
        if j in others:
            odds.append(min(3.6 * np.log(by_bands) + others[j][0], others[j][1]))
        x = max(*odds, dense.get(j, -np.inf))
        if j in others and risen.get(j, 0) < 1 and x > -4:
            x = pulse_odds(x, c, b, place, j, frame)
        found[j] = 1 / (1 + np.exp(-x))
    return found


def calibrated(judged, f1, pace, counts, seconds, spread):
    """Probabilities as they turn out in a record of such an expected F1 and impacts a second.

    `counts` are those of crests of log-odds from -3 to -1.5, to 0 and to 1.5.
    """
    clear = max(0, 1 - (1 - f1) / 0.03)
    more = 0.7 * clear**2 * min(1, pace / 13.5)
    if pace > 13.5:
        more += min(8 * np.log(pace / 13.5), 3)
    more += 2.5 * np.log(max(1, spread / 0.16)) * np.clip((pace - 6) / 4, 0, 1)
    more *= (1 - 0.4 * clear) * (1 - clear**16)
    improbable, below, above = counts
    e = np.clip((0.3 - np.log((below + 2) / (above + 1))) / 0.6, 0, 1)
    lost = 2.5 + 0.5 * np.log(10 * spread) + 0.6 * max(0, np.log((1 - f1) / 0.03))
    lost -= 1.2 * np.log((improbable / seconds + 0.02) / (below / seconds + 0.02))
    lost -= 1.9 * np.clip(np.log(pace / 13.5) / 0.3, 0, 1)
    e *= np.clip((pace - 6) / 4, 0, 1)
    more += e * lost
    turned = {}
    for j, p in judged.items():
        odds = np.log(p / (1 - p)) if p < 1 else 50
        odds *= 1 + (0.75 * clear if odds > 0 else 0.5 * clear + 0.27 * e)
        odds += more
        turned[j] = 1 / (1 + np.exp(-odds))
    return turned


def with_overlap(judged, narrow, share, every, pace):
    """Probabilities where impacts are dense; `every` are those of all crests that octaves show."""

    def odds(p):
        return np.log(p / (1 - p))

    x = odds(np.array(every))
    doubtful, clear = x[np.abs(x) < 3], x[x > 2]
    mean = (4 + np.sum(1 / (1 + np.exp(-doubtful)))) / (10 + len(doubtful))
    c = np.mean(np.minimum(clear, 12))
    h = min(max((pace - 14) / 6, 0), 1) * min(max(9.3 - c, 0), 1)
    record = 2.2 + 1.2 * (odds(mean) - odds(0.4)) - 0.7 * (c - 5)
    turned = {}
    for j, p in judged.items():
        y = min(max(odds(p), -5), 6)
        more = record + (0.22 if y > 0 else -0.6) * y + 1.5 * np.log(max(share[j], np.exp(-3)))
        more *= 0 if narrow[j] else h
        turned[j] = 1 / (1 + np.exp(-odds(p) - more))
    return turned


def attack(x, at, scale):
    """First sample after the likeliest change of variance."""
    best = (-1.0, at)
    first = max(at - scale.past * scale.hop, scale.long_lag + scale.slope)
    last = min(at + scale.forward * scale.hop, len(x))
    for lag in (scale.short_lag, scale.long_lag):
        y = []
        for i in range(first, last):
            slope = (x[i - lag] - x[i - lag - scale.slope]) / scale.slope
            y.append(x[i] - (x[i - lag] + lag * slope))
        y = np.array(y)
        for k in range(1, len(y)):
            before, after = np.mean(y[:k] ** 2), np.mean(y[k:] ** 2)
            if abs(first + k - at) <= scale.reach and after > before > 0:
                gain = len(y) * np.log(np.mean(y**2))
                gain -= k * np.log(before) + (len(y) - k) * np.log(after)
                best = max(best, (gain, first + k), key=lambda item: item[0])
    return best[1]


def log_probability(y, q, k, error, prior):
    """ln of the density of y = Q a + K b + e where Q' leaves off: b ~ N(0, E V), e ~ N(0, s E).

    Q has orthonormal columns, and a may be anything, so only what is orthogonal to Q counts.
    """
    energy = y @ y
    rest = np.linalg.svd(q, full_matrices=True)[0][:, q.shape[1] :]
    z, b = rest.T @ y, rest.T @ k
    covariance = energy * (b @ np.diag(prior) @ b.T + error * np.eye(len(z)))
    sign, logarithm = np.linalg.slogdet(covariance)
    assert sign > 0
    return -0.5 * z @ np.linalg.solve(covariance, z) - 0.5 * logarithm


def crossing(y, begin, end, level, fine):
    """Where |y|, by a sinc under a cosine, first reaches a level, in steps of 1 / fine samples."""
    for i in range(fine * (end - begin)):
        if modulus(y, begin + i / fine) >= level:
            return begin + i / fine
    return np.nan


def modulus(y, at):
    """|y| between samples, by a sinc under a cosine."""
    away = at - np.arange(len(y))
    window = np.where(np.abs(away) < 8, np.cos(np.pi * away / 16) ** 2, 0.0)
    return abs(np.sum(y * np.sinc(away) * window))


def peak(x, split, scale):
    """Greatest deviation after an attack from the mean before it."""
    before = x[max(split - scale.past * scale.hop, 0) : split]
    return np.abs(x[split : split + scale.forward * scale.hop] - before.mean()).max()
