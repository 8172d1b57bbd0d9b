"""Trains the same small network on images of several kinds and tests all of them on other towns.

    python3 bench/training_value.py --omnibus target/release/omnibus --out runs --device cuda

Needs PyTorch. Every kind of images ("arm") is a plan of the same towns, seeds, traffic and poses, so that
arms differ in what the images show alone. The test images are of towns that no arm has seen, at `epic`, under every weather and hour, with
the effects of a real camera: the nearest to photographs that the simulator has. An arm may also come from another
build of the program: `--also NAME=PATH`.

The network is a U-Net of 1.9 million weights (O. Ronneberger, P. Fischer and T. Brox, MICCAI 2015), its measure the
mean intersection over union of the classes below.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import time

import numpy
import torch
from torch import nn
from torch.nn import functional

# Classes, with the tags of each (docs/sensors.md). What is in none of them is not counted.
CLASSES = {
    "road": [1],
    "marking": [24],
    "sidewalk": [2],
    "building": [3, 4, 5],
    "vegetation": [9],
    "ground": [10, 22, 25],
    "pole": [6],
    "light and sign": [7, 8],
    "sky": [11],
    "person": [12, 13],
    "vehicle": [14, 15, 16, 18, 19],
}
IGNORED = 255
SIZE = (320, 240)

TRAINING_MAPS = ["Millbrook", "Altmarkt", "Longreach"]
TEST_MAPS = ["Flatford", "Greatmoor", "Fernhill"]
CLEAR = [{"preset": "clear"}]
WEATHERS = [{"preset": name} for name in ("clear", "rain", "fog")]
NOON = [13.5]
HOURS = [13.5, 17.75, 22.0]
EFFECTS = (
    '{ exposure = "automatic", bloom = 0.06, vignette = 0.5, chromatic_aberration = 0.004, '
    "white_electrons = 6000, read_electrons = 8 }"
)

# Arms: quality, weathers, hours, effects.
ARMS = {
    "low, noon": ("low", CLEAR, NOON, False),
    "standard, noon": ("standard", CLEAR, NOON, False),
    "low, all lights": ("low", WEATHERS, HOURS, False),
    "standard, all lights": ("standard", WEATHERS, HOURS, False),
    "standard, all lights, effects": ("standard", WEATHERS, HOURS, True),
    "epic, all lights, effects": ("epic", WEATHERS, HOURS, True),
}


def plan(maps, quality, weathers, hours, effects, images, seed):
    """Returns a plan with as many images as asked for, spread over its scenes."""
    scenes = len(maps) * len(weathers) * len(hours)
    repeats = max(1, 24 // scenes)
    frames = -(-images // (scenes * repeats))
    lines = [
        f"scenes = {scenes * repeats}",
        f"frames = {frames}",
        "every = 8",
        f"seed = {seed}",
        f"maps = {json.dumps(maps)}",
        f"hours = {json.dumps(hours)}",
        "[traffic]\nvehicles = 60\nwalkers = 40",
        '[images]\nformat = "npy"',
    ]
    for weather in weathers:
        lines.append("[[weather]]")
        lines += [f"{name} = {json.dumps(value)}" for name, value in weather.items()]
    lines += [
        "[[sensor]]",
        'name = "front"',
        'kind = "camera"',
        "position_m = [1.6, 0.0, 1.5]",
        f"width_px = {SIZE[0]}",
        f"height_px = {SIZE[1]}",
        'outputs = ["color", "tag"]',
    ]
    if quality:
        lines.append(f'quality = "{quality}"')
    if effects:
        lines.append(f"effects = {EFFECTS}")
    return "\n".join(lines) + "\n"


def collected(program, text, folder, device, shards):
    """Collects a plan and returns its images and classes."""
    folder.mkdir(parents=True)
    (folder / "plan.toml").write_text(text)
    begin = time.time()
    command = [program, "collect", folder / "plan.toml", "--out", folder / "data"]
    command += ["--device", device, "--json"]
    running = [
        subprocess.Popen([*command, "--shard", f"{shard}/{shards}"], stdout=subprocess.DEVNULL)
        for shard in range(shards)
    ]
    if any([process.wait() for process in running]):
        raise SystemExit(f"{program} has not collected {folder / 'plan.toml'}")
    table = numpy.full(256, IGNORED, numpy.uint8)
    for number, tags in enumerate(CLASSES.values()):
        table[tags] = number
    colors, classes = [], []
    for path in sorted((folder / "data").glob("scene-*/front/color/*.npy")):
        colors.append(numpy.load(path)[..., :3])
        classes.append(table[numpy.load(path.parent.parent / "tag" / path.name)])
    print(f"{len(colors)} images in {time.time() - begin:.0f} s", flush=True)
    return numpy.stack(colors), numpy.stack(classes)


def block(inputs, outputs):
    layers = []
    for number in (inputs, outputs):
        layers += [nn.Conv2d(number, outputs, 3, padding=1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()]
    return nn.Sequential(*layers)


class UNet(nn.Module):
    def __init__(self, widths=(32, 64, 128, 256)):
        super().__init__()
        self.down = nn.ModuleList(block(a, b) for a, b in zip((3, *widths), widths))
        pairs = list(zip(widths[:0:-1], widths[-2::-1]))
        self.up = nn.ModuleList(block(a + b, b) for a, b in pairs)
        self.last = nn.Conv2d(widths[0], len(CLASSES), 1)

    def forward(self, images):
        kept, x = [], images
        for number, layer in enumerate(self.down):
            x = layer(x if number == 0 else functional.max_pool2d(x, 2))
            kept.append(x)
        kept.pop()
        for layer in self.up:
            x = functional.interpolate(x, scale_factor=2, mode="nearest")
            x = layer(torch.cat([x, kept.pop()], 1))
        return self.last(x)


def batch(data, index, device):
    colors, classes = (torch.from_numpy(part[index]).to(device) for part in data)
    return (colors.permute(0, 3, 1, 2).float() / 255 - 0.45) / 0.25, classes.long()


def trained(data, seed, epochs, device):
    torch.manual_seed(seed)
    random = numpy.random.default_rng(seed)
    network = UNet().to(device)
    optimizer = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=1e-2)
    count, size = len(data[0]), 32
    steps = epochs * (count // size)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 2e-3, steps)
    network.train()
    for _ in range(epochs):
        order = random.permutation(count)
        for first in range(0, count - size + 1, size):
            images, classes = batch(data, order[first : first + size], device)
            if random.random() < 0.5:
                images, classes = images.flip(3), classes.flip(2)
            # Brightness and contrast, as every training has.
            gain = 1 + 0.2 * torch.randn(size, 3, 1, 1, device=device)
            shift = 0.2 * torch.randn(size, 1, 1, 1, device=device)
            with torch.autocast(device, torch.bfloat16):
                output = network(images * gain + shift)
            loss = functional.cross_entropy(output.float(), classes, ignore_index=IGNORED)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
    return network.eval()


@torch.no_grad()
def overlaps(network, data, device):
    """Returns the intersection over union of each class."""
    kinds = len(CLASSES)
    table = torch.zeros(kinds, kinds, device=device)
    for first in range(0, len(data[0]), 64):
        images, classes = batch(data, slice(first, first + 64), device)
        found = network(images).argmax(1)
        counted = classes != IGNORED
        pairs = classes[counted] * kinds + found[counted]
        table += torch.bincount(pairs, minlength=kinds * kinds).view(kinds, kinds)
    both = table.diag()
    return (both / (table.sum(0) + table.sum(1) - both).clamp(min=1)).tolist()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--omnibus", default="omnibus", help="the program")
    parser.add_argument("--also", action="append", default=[], metavar="NAME=PATH", help="another build: an arm")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="a folder that does not exist yet")
    parser.add_argument("--images", type=int, default=2000, help="of each arm")
    parser.add_argument("--tests", type=int, default=640, help="test images")
    parser.add_argument("--epochs", type=int, default=12)
    parser.add_argument("--seeds", type=int, default=3, help="trainings of each arm")
    parser.add_argument("--device", default="cuda", help="of PyTorch")
    parser.add_argument("--shards", type=int, default=4, help="simulators that collect at the same time")
    parser.add_argument("--tracer", default="auto", help="of the program: --device")
    given = parser.parse_args()
    text = plan(TEST_MAPS, "epic", WEATHERS, HOURS, True, given.tests, 900)
    test = collected(given.omnibus, text, given.out / "test", given.tracer, given.shards)
    arms = {name: (given.omnibus, *arm) for name, arm in ARMS.items()}
    for other in given.also:
        name, path = other.split("=", 1)
        arms[name] = (path, None, WEATHERS, HOURS, False)
    print(f"{'arm':<32}{'mIoU':>7}{'spread':>8}  " + "".join(f"{name:>15}" for name in CLASSES))
    for number, (name, (program, *arm)) in enumerate(arms.items()):
        text = plan(TRAINING_MAPS, *arm, given.images, 100)
        data = collected(program, text, given.out / f"arm-{number}", given.tracer, given.shards)
        runs = []
        for seed in range(given.seeds):
            runs.append(overlaps(trained(data, seed, given.epochs, given.device), test, given.device))
        means = [statistics.mean(run) for run in runs]
        by_class = [statistics.mean(run[kind] for run in runs) for kind in range(len(CLASSES))]
        row = f"{name:<32}{statistics.median(means):>7.3f}{max(means) - min(means):>8.3f}  "
        print(row + "".join(f"{share:>15.3f}" for share in by_class), flush=True)


if __name__ == "__main__":
    main()
