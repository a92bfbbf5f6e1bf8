"""An oscillator as forces on its mass, with how far rounding makes each uncertain."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from impactsig import KelvinVoigt, Rigid

# Roundings in a sum of several parts, each of up to an ulp.
FEW = 8 * np.finfo(float).eps


class Contact(NamedTuple):
    """A soft stop at instants: how deep the mass is in it, and what it pushes back with."""

    law: KelvinVoigt
    sign: int
    depth: np.ndarray
    push: np.ndarray
    drag: np.ndarray  # what of that is the damper's
    blur: np.ndarray  # how far the depth is uncertain


class Scene:
    """An oscillator that started at a phase of its reference forcing, and its motion.

    Attributes
    ----------
    digit : float
        How well an instant of the motion is known [s]: to its digits, and those of the phase.
    late : float
        The same in the oscillator's unit of time.
    """

    def __init__(self, machine, phase, motion):
        self.machine, self.motion = machine, motion
        self.unit = machine.time_unit
        self.reference = (
            machine.angular_forcing_frequency or machine.angular_natural_frequency or 1.0
        )
        self.ahead = phase / self.reference
        self.rigid = [stop for stop in machine.stops if isinstance(stop.law, Rigid)]
        self.soft = [stop for stop in machine.stops if isinstance(stop.law, KelvinVoigt)]
        self.kinetic = machine.friction.kinetic if machine.friction else 0.0
        self.static = machine.friction.static if machine.friction else 0.0
        longest = max(abs(motion.start), abs(motion.stop))
        lap = np.spacing(2 * math.pi) * self.unit / self.reference
        self.digit = 4 * max(np.spacing(longest), lap)
        self.late = self.digit / self.unit

    def base(self, time):
        """Displacement, velocity and acceleration of the base."""
        base = self.machine.base
        if base is None:
            return 0.0, 0.0, 0.0
        w = base.angular_frequency
        angle = w * (time / self.unit + self.ahead) + base.phase
        c, s = base.amplitude * np.cos(angle), base.amplitude * np.sin(angle)
        return c, -w * s, -w * w * c

    def lasting(self, k, c):
        """The rate that lasts under a stiffness and a damping: the slow one, if overdamped."""
        middle = np.maximum(np.sqrt(k * self.machine.mass), c / 2)
        return np.divide(k, middle, out=np.zeros_like(k), where=k > 0)

    def rounding(self, k, c, x, v):
        """How far places and velocities up to x, v under a stiffness and a damping are uncertain.

        The closed form is a sum of a forced response, which is large near resonance, a rest
        position, on springs that are stiff against the forcing, and a free motion as large as both.
        What carries the stops is added, at an instant of its own rounding.
        """
        machine, m = self.machine, self.machine.mass
        stiff = k >= m * self.reference**2
        places = np.abs(x) + sum(abs(stop.position) for stop in machine.stops)
        places = places + (abs(machine.load) + self.kinetic) * stiff / np.where(stiff, k, 1.0)
        speeds = np.abs(v)
        waves = [(f.angular_frequency, f.amplitude) for f in machine.forces]
        if machine.base is not None:
            w = machine.base.angular_frequency
            pull = machine.stiffness + machine.damping * w + m * w * w
            waves.append((w, pull * machine.base.amplitude))
        for w, amplitude in waves:
            response = amplitude / np.abs(k - m * w * w + 1j * c * w)
            places, speeds = places + response, speeds + w * response
        places, speeds = FEW * places, FEW * (speeds + self.lasting(k, c) * places)
        if machine.base is not None and machine.base.stops:
            w, swing = machine.base.angular_frequency, self.late * machine.base.amplitude
            places, speeds = places + w * swing, speeds + w * w * swing
        return places, speeds


class State:
    """The motion at instants.

    Attributes
    ----------
    x, v : ndarray
        Displacement and velocity.
    at, moving, pace : ndarray or float
        Displacement, velocity, acceleration of what the stops stand on, and the mass rubs against.
    contacts : list of Contact
    """

    def __init__(self, scene, time, place=0.0):
        """`place` is how far x is uncertain, but for its own digits and those of the instant."""
        base = scene.machine.base
        self.scene, self.time = scene, time
        self.x, self.v = scene.motion.sample(time)
        self.base = scene.base(time)
        carried = base is not None and base.stops
        self.at, self.moving, self.pace = self.base if carried else (0.0, 0.0, 0.0)
        self.blur = place + scene.late * np.abs(self.moving)
        self.contacts = [self._contact(stop) for stop in scene.soft]

    def depth(self, stop):
        """How far the mass is beyond a stop, and how far that is uncertain."""
        sign = 1 if stop.side == "upper" else -1
        blur = FEW * (np.abs(self.x) + np.abs(self.at) + abs(stop.position)) + self.blur
        return sign * (self.x - self.at - stop.position), blur

    def _contact(self, stop):
        law, sign = stop.law, 1 if stop.side == "upper" else -1
        depth, blur = self.depth(stop)
        drag = law.damping * sign * (self.v - self.moving)
        push = law.stiffness * depth + drag
        if law.ends == "force":
            push = np.maximum(push, 0)
        return Contact(law, sign, depth, np.where(depth > 0, push, 0.0), drag, blur)

    def force(self):
        """Every force on the mass but friction and the reactions of rigid stops; its rounding.

        A soft stop is pressed by a difference of places, and by no more digits than these have.
        Forcing and base are known as the instant is.
        """
        scene, machine = self.scene, self.scene.machine
        t = self.time / scene.unit + scene.ahead
        hangs = bool(machine.base and machine.base.spring) * machine.stiffness
        drags = bool(machine.base and machine.base.damper) * machine.damping
        at, moving, pace = self.base
        parts = [machine.load, -machine.stiffness * self.x, -machine.damping * self.v]
        parts += [hangs * at, drags * moving]
        parts += [f.amplitude * np.cos(f.angular_frequency * t + f.phase) for f in machine.forces]
        total, size = sum(parts), sum(np.abs(part) for part in parts)
        rate = sum(f.amplitude * f.angular_frequency for f in machine.forces)
        rate = rate + np.abs(hangs * moving) + np.abs(drags * pace)
        blurred = 0.0
        for law, sign, depth, push, drag, blur in self.contacts:
            near = depth > -blur
            total = total - sign * push
            size = size + near * law.damping * (np.abs(self.v) + np.abs(self.moving))
            rate = rate + near * law.damping * np.abs(self.pace)
            blurred = blurred + near * law.stiffness * blur + (np.abs(depth) <= blur) * np.abs(drag)
        return total, FEW * size + scene.late * rate + blurred

    def pressed(self):
        """Stiffness and damping of spring and damper, and of the soft stops that push."""
        stiffness = np.full(np.shape(self.x), float(self.scene.machine.stiffness))
        damping = np.full(np.shape(self.x), float(self.scene.machine.damping))
        for contact in self.contacts:
            pushes = contact.push != 0
            stiffness += pushes * contact.law.stiffness
            damping += pushes * contact.law.damping
        return stiffness, damping

    def penetrates(self):
        """Whether the mass is beyond a rigid stop by more than rounding explains."""
        beyond = np.zeros(np.shape(self.x), bool)
        for stop in self.scene.rigid:
            depth, blur = self.depth(stop)
            beyond |= depth > blur
        return beyond
