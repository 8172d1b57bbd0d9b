"""Data sets of the same frames whose images are stored in different formats: their own readers find the same."""

import io
import pathlib
import sys

import numpy as np
import zstandard
from PIL import Image

folder = pathlib.Path(sys.argv[1])
FAR_M = 655.35


def files(name: str, output: str, extension: str) -> list[pathlib.Path]:
    """Returns the files of an output, in the order of frames."""
    found = sorted((folder / name / "front" / output).iterdir())
    assert found and all(path.name.endswith("." + extension) for path in found), found
    return found


def array(path: pathlib.Path) -> np.ndarray:
    """Reads an array, compressed or not."""
    data = path.read_bytes()
    if path.name.endswith(".zst"):
        data = zstandard.ZstdDecompressor().decompress(data)
    return np.load(io.BytesIO(data))


def picture(path: pathlib.Path) -> np.ndarray:
    """Reads a PNG or JPEG."""
    return np.array(Image.open(path))


frames = 0
for index, path in enumerate(files("png", "color", "png")):
    color = picture(path)
    lossy = picture(files("jpeg", "color", "jpg")[index])
    assert lossy.shape == color.shape
    difference = np.abs(lossy.astype(int) - color)
    assert difference.mean() < 2.5, difference.mean()
    # Red and blue are not exchanged.
    assert difference.mean() < 0.5 * np.abs(lossy[..., ::-1].astype(int) - color).mean()
    depth = picture(files("png", "depth", "png")[index]) / 100
    tag = picture(files("png", "tag", "png")[index])
    ids = picture(files("png", "instance", "png")[index]).astype(np.uint32)
    ids = ids @ np.array([1, 256, 65536], np.uint32)
    for output in ("depth", "tag", "instance"):
        same = [files(name, output, "png")[index].read_bytes() for name in ("png", "jpeg")]
        assert same[0] == same[1], output
    for name in ("npy", "npy.zst"):
        read = {o: array(files(name, o, name)[index]) for o in ("color", "depth", "tag", "instance")}
        kinds = {o: (str(a.dtype), a.shape) for o, a in read.items()}
        assert kinds == {
            "color": ("uint8", color.shape),
            "depth": ("float32", depth.shape),
            "tag": ("uint8", tag.shape),
            "instance": ("uint32", ids.shape),
        }, kinds
        assert (read["color"] == color).all() and (read["tag"] == tag).all()
        assert (read["instance"] == ids).all()
        metres = np.minimum(read["depth"], FAR_M)
        assert np.abs(metres - depth).max() <= 0.00501, np.abs(metres - depth).max()
        assert 100 < read["depth"].max() == 1000.0, "the sky"
    frames += 1
assert frames == 3
print(f"{frames} frames in four formats hold the same")
