"""Learns to keep the lane by proximal policy optimisation (PPO), on the processor, with NumPy alone.

    python ppo_lane_keeping.py --steps 400000 --curve curve.csv --picture curve.svg

The environment is ``Omnibus/Drive-v0`` with the state vector and without other vehicles. Before and
after, three policies drive the same routes, which are not among those of the training: the learned
one, random actions, and a lane follower written by hand. Source of the method: Schulman and others,
"Proximal policy optimization algorithms", 2017; "High-dimensional continuous control using generalized
advantage estimation", 2016.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnibus.gym import DriveConfig, DriveEnv, State

Array = NDArray[np.float64]
Policy = Callable[[Array], Array]

CONFIG = DriveConfig(observations=State(), vehicles=0)
ENVIRONMENTS = 8
#: Steps of each environment between two updates.
HORIZON = 256
EPOCHS = 10
BATCH = 256
GAMMA, LAMBDA = 0.99, 0.95
CLIP = 0.2
ENTROPY = 0.001
LEARNING_RATE = 3e-4
GRADIENT_MAX = 0.5
#: Rewards are learned in this unit, so that returns are of the order of one.
REWARD_SCALE = 0.1
#: The first seed of the routes on which policies are compared.
HELD_OUT = 1_000_000


class Layers:
    """A network of two hidden layers of 64 with tanh, and its gradient."""

    def __init__(self, inputs: int, outputs: int, last_gain: float, random: np.random.Generator) -> None:
        sizes = (inputs, 64, 64, outputs)
        gains = (math.sqrt(2), math.sqrt(2), last_gain)
        self.parameters: list[Array] = []
        for rows, columns, gain in zip(sizes, sizes[1:], gains):
            # Orthogonal, as usual for PPO.
            q, r = np.linalg.qr(random.normal(size=(max(rows, columns), min(rows, columns))))
            q = q * np.sign(np.diag(r))
            self.parameters += [gain * (q if rows >= columns else q.T), np.zeros(columns)]

    def forward(self, inputs: Array) -> list[Array]:
        """Returns what each layer gives; the last is the output."""
        w1, b1, w2, b2, w3, b3 = self.parameters
        first = np.tanh(inputs @ w1 + b1)
        second = np.tanh(first @ w2 + b2)
        return [inputs, first, second, second @ w3 + b3]

    def gradient(self, layers: list[Array], to_output: Array) -> list[Array]:
        """Returns the gradient by each parameter, from that by the output."""
        _, _, w2, _, w3, _ = self.parameters
        inputs, first, second, _ = layers
        to_second = (to_output @ w3.T) * (1 - second**2)
        to_first = (to_second @ w2.T) * (1 - first**2)
        gradient: list[Array] = []
        for source, to in ((inputs, to_first), (first, to_second), (second, to_output)):
            gradient += [source.T @ to, to.sum(axis=0)]
        return gradient


class Adam:
    """The optimiser (Kingma and Ba, 2015), with a limit on the length of the gradient."""

    def __init__(self, parameters: list[Array]) -> None:
        self.parameters = parameters
        self.mean = [np.zeros_like(p) for p in parameters]
        self.square = [np.zeros_like(p) for p in parameters]
        self.count = 0

    def step(self, gradient: list[Array], rate: float) -> None:
        """Changes the parameters in place."""
        length = math.sqrt(sum(float((g**2).sum()) for g in gradient))
        scale = min(1.0, GRADIENT_MAX / (length + 1e-8))
        self.count += 1
        unbiased = rate * math.sqrt(1 - 0.999**self.count) / (1 - 0.9**self.count)
        for p, m, s, g in zip(self.parameters, self.mean, self.square, gradient):
            m += 0.1 * (scale * g - m)
            s += 0.001 * ((scale * g) ** 2 - s)
            p -= unbiased * m / (np.sqrt(s) + 1e-8)


class Scale:
    """Mean and variance of the observations so far."""

    def __init__(self, size: int) -> None:
        self.mean, self.variance, self.count = np.zeros(size), np.ones(size), 1e-4

    def take(self, batch: Array) -> None:
        """Takes in a batch (Chan and others, 1979)."""
        count = len(batch)
        total = self.count + count
        offset = batch.mean(axis=0) - self.mean
        self.variance = (
            self.variance * self.count
            + batch.var(axis=0) * count
            + offset**2 * self.count * count / total
        ) / total
        self.mean = self.mean + offset * count / total
        self.count = total

    def of(self, observations: Array) -> Array:
        """Returns observations with mean 0 and variance 1, limited to ±10."""
        scaled: Array = (observations - self.mean) / np.sqrt(self.variance + 1e-8)
        return scaled.clip(-10, 10)


@dataclass
class Score:
    """How a policy drives."""

    episode_return: float
    arrived: float
    speed_mps: float
    beside_m: float

    def __str__(self) -> str:
        return (
            f"return {self.episode_return:7.1f}, routes completed {self.arrived:4.0%}, "
            f"speed {self.speed_mps:4.1f} m/s, from the lane's middle {self.beside_m:4.2f} m"
        )


def score(policy: Policy, episodes: int) -> Score:
    """Drives routes that the training does not use."""
    env = DriveEnv(CONFIG)
    returns: list[float] = []
    arrived = 0
    speeds: list[float] = []
    beside: list[float] = []
    for episode in range(episodes):
        observation, info = env.reset(seed=HELD_OUT + episode)
        total, ended = 0.0, False
        while not ended:
            action = policy(observation.astype(np.float64))
            observation, reward, terminated, truncated, info = env.step(action.clip(-1, 1))
            total += reward
            ended = terminated or truncated
            speeds.append(info["speed_mps"])
            beside.append(abs(info["left_m"]))
        returns.append(total)
        arrived += info["ending"] == "arrival"
    return Score(
        float(np.mean(returns)), arrived / episodes, float(np.mean(speeds)), float(np.mean(beside))
    )


def follow_lane(observation: Array) -> Array:
    """A lane follower written by hand: steers to the point of the route 6 m ahead, and drives at the
    limit, slower where the route 30 m ahead lies to the side."""
    speed_mps, limit_mps = 30 * observation[0], 30 * observation[1]
    steer = 2.0 * math.atan2(observation[11], observation[10])
    bend = abs(math.atan2(observation[19], observation[18]))
    target_mps = min(limit_mps, 14.0) * max(0.3, 1.0 - 1.2 * bend)
    return np.array([steer, 0.4 * (target_mps - speed_mps)]).clip(-1, 1)


class Learner:
    """Policy, value and their training."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.envs = [DriveEnv(CONFIG) for _ in range(ENVIRONMENTS)]
        firsts = [env.reset(seed=seed + index)[0] for index, env in enumerate(self.envs)]
        self.observations = np.array(firsts, np.float64)
        size = self.observations.shape[1]
        self.scale = Scale(size)
        self.policy = Layers(size, 2, 0.01, self.random)
        self.value = Layers(size, 1, 1.0, self.random)
        self.log_deviation = np.full(2, -0.5)
        self.adam = Adam([*self.policy.parameters, self.log_deviation, *self.value.parameters])
        #: Returns and arrivals of the episodes that ended since the last update.
        self.ended: list[tuple[float, bool]] = []
        self.totals = [0.0] * ENVIRONMENTS

    def act(self, observation: Array) -> Array:
        """Returns the policy's best action."""
        action: Array = self.policy.forward(self.scale.of(observation[None]))[-1][0]
        return action

    def log_probability(self, mean: Array, actions: Array) -> Array:
        """Returns the logarithm of the density of actions."""
        normal = (actions - mean) / np.exp(self.log_deviation)
        density: Array = -0.5 * (normal**2 + math.log(2 * math.pi)) - self.log_deviation
        total: Array = density.sum(axis=-1)
        return total

    def iterate(self, rate: float) -> None:
        """Drives ``HORIZON`` steps in each environment and learns from them."""
        shape = (HORIZON, ENVIRONMENTS)
        observed = np.empty((*shape, self.observations.shape[1]))
        actions, probabilities = np.empty((*shape, 2)), np.empty(shape)
        values, rewards, goes_on = np.empty(shape), np.empty(shape), np.ones(shape)
        self.scale.take(self.observations)
        for step in range(HORIZON):
            observed[step] = self.scale.of(self.observations)
            mean = self.policy.forward(observed[step])[-1]
            noise = self.random.normal(size=mean.shape)
            actions[step] = mean + np.exp(self.log_deviation) * noise
            probabilities[step] = self.log_probability(mean, actions[step])
            values[step] = self.value.forward(observed[step])[-1][:, 0]
            for index, env in enumerate(self.envs):
                action = actions[step, index].clip(-1, 1)
                after, reward, terminated, truncated, info = env.step(action)
                self.totals[index] += reward
                rewards[step, index] = REWARD_SCALE * reward
                if truncated:
                    # The episode is cut, the route is not at its end: its value is what is expected.
                    rest = self.value.forward(self.scale.of(after[None].astype(np.float64)))[-1]
                    rewards[step, index] += GAMMA * float(rest[0, 0])
                if terminated or truncated:
                    goes_on[step, index] = 0.0
                    self.ended.append((self.totals[index], info["ending"] == "arrival"))
                    self.totals[index] = 0.0
                    after, _ = env.reset()
                self.observations[index] = after
            self.scale.take(self.observations)
        advantages = np.empty(shape)
        after_value = self.value.forward(self.scale.of(self.observations))[-1][:, 0]
        carried = np.zeros(ENVIRONMENTS)
        for step in reversed(range(HORIZON)):
            error = rewards[step] + GAMMA * goes_on[step] * after_value - values[step]
            carried = error + GAMMA * LAMBDA * goes_on[step] * carried
            advantages[step], after_value = carried, values[step]
        self.learn(
            observed.reshape(-1, observed.shape[-1]),
            actions.reshape(-1, 2),
            probabilities.ravel(),
            advantages.ravel(),
            (advantages + values).ravel(),
            rate,
        )

    def learn(
        self,
        observed: Array,
        actions: Array,
        probabilities: Array,
        advantages: Array,
        returns: Array,
        rate: float,
    ) -> None:
        """Updates policy and value from what was driven."""
        count = len(observed)
        for _ in range(EPOCHS):
            order = self.random.permutation(count)
            for first in range(0, count, BATCH):
                part = order[first : first + BATCH]
                advantage = advantages[part]
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                layers = self.policy.forward(observed[part])
                off = actions[part] - layers[-1]
                logarithm = self.log_probability(layers[-1], actions[part])
                ratio = np.exp(logarithm - probabilities[part])
                # The clipped objective is flat where the ratio has gone far enough.
                is_flat = np.where(advantage > 0, ratio > 1 + CLIP, ratio < 1 - CLIP)
                by_logarithm = np.where(is_flat, 0.0, -advantage * ratio) / len(part)
                variance = np.exp(2 * self.log_deviation)
                by_mean = by_logarithm[:, None] * off / variance
                by_deviation = (by_logarithm[:, None] * (off**2 / variance - 1)).sum(axis=0)
                valued = self.value.forward(observed[part])
                by_value = (valued[-1] - returns[part, None]) / len(part)
                gradient = [
                    *self.policy.gradient(layers, by_mean),
                    by_deviation - ENTROPY,
                    *self.value.gradient(valued, by_value),
                ]
                self.adam.step(gradient, rate)


def draw(path: str, rows: list[tuple[int, float, float]], title: str) -> None:
    """Writes the learning curve as SVG: return on the left, completed routes on the right."""
    width, height, left, top, right, bottom = 640, 320, 60, 40, 60, 45
    most_steps = max(row[0] for row in rows)
    returns = [row[1] for row in rows]
    # Four intervals of a round number.
    interval, low = 25.0, 0.0
    while low > min(returns) or low + 4 * interval < max(returns):
        interval += 25.0
        low = interval * math.floor(min(0.0, *returns) / interval)
    high = low + 4 * interval

    def line(values: list[tuple[int, float]], color: str, least: float, most: float) -> str:
        points = " ".join(
            f"{left + (width - left - right) * steps / most_steps:.1f},"
            f"{height - bottom - (height - top - bottom) * (value - least) / (most - least):.1f}"
            for steps, value in values
        )
        return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"/>'

    def text(x: float, y: float, words: str, anchor: str, color: str = "#444") -> str:
        return f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{color}">{words}</text>'

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        text(width / 2, 20, title, "middle"),
        text(8, 34, "return of an episode", "start", "#1f5fa8"),
        text(width - 8, 34, "routes completed", "end", "#c2571a"),
        text(width / 2, height - 8, "steps", "middle"),
    ]
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = height - bottom - (height - top - bottom) * share
        parts.append(f'<path d="M{left} {y}H{width - right}" stroke="#ddd"/>')
        parts.append(text(left - 6, y + 4, f"{low + (high - low) * share:.0f}", "end", "#1f5fa8"))
        parts.append(text(width - right + 6, y + 4, f"{share:.0%}", "start", "#c2571a"))
        x = left + (width - left - right) * share
        parts.append(text(x, height - bottom + 18, f"{most_steps * share / 1000:.0f}k", "middle"))
    parts.append(line([(row[0], row[2]) for row in rows], "#e08a4f", 0.0, 1.0))
    parts.append(line([(row[0], row[1]) for row in rows], "#1f5fa8", low, high))
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join([*parts, "</svg>\n"]))


def main() -> None:
    """Trains, and compares policies before and after."""
    parser = argparse.ArgumentParser(description="PPO learns to keep the lane")
    parser.add_argument("--steps", type=int, default=400_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--episodes", type=int, default=50, help="routes on which policies are compared")
    parser.add_argument("--curve", help="a CSV file: steps, mean return, share of routes completed")
    parser.add_argument("--picture", help="an SVG file of the learning curve")
    args = parser.parse_args()

    learner = Learner(args.seed)
    random = np.random.default_rng(args.seed)
    print("random actions: ", score(lambda _: random.uniform(-1, 1, 2), args.episodes), flush=True)
    print("written by hand:", score(follow_lane, args.episodes), flush=True)
    print("before training:", score(learner.act, args.episodes), flush=True)
    batch = HORIZON * ENVIRONMENTS
    rows: list[tuple[int, float, float]] = []
    begin = time.perf_counter()
    updates = max(1, args.steps // batch)
    for update in range(updates):
        learner.iterate(LEARNING_RATE * (1 - update / updates))
        steps = (update + 1) * batch
        if learner.ended and (len(learner.ended) >= 20 or update + 1 == updates):
            returns, arrivals = zip(*learner.ended)
            rows.append((steps, float(np.mean(returns)), float(np.mean(arrivals))))
            learner.ended.clear()
            rate = steps / (time.perf_counter() - begin)
            print(
                f"{steps:7d} steps, {rate:5.0f} steps/s: return {rows[-1][1]:7.1f}, "
                f"routes completed {rows[-1][2]:4.0%}",
                flush=True,
            )
    took = time.perf_counter() - begin
    print(f"trained {updates * batch} steps in {took:.0f} s, {updates * batch / took:.0f} steps/s")
    print("after training: ", score(learner.act, args.episodes))
    if args.curve:
        with open(args.curve, "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([("steps", "return", "completed"), *rows])
    if args.picture:
        draw(args.picture, rows, "PPO on Omnibus/Drive-v0, without other vehicles")


if __name__ == "__main__":
    main()
