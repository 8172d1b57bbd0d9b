"""Images into arrays: bytes, metres, labels, points."""

import numpy

# 0.8's thirteen labels in Cityscapes' colours.
PALETTE = numpy.array([
    (0, 0, 0),  # none
    (70, 70, 70),  # buildings
    (190, 153, 153),  # fences
    (72, 0, 90),  # other
    (220, 20, 60),  # pedestrians
    (153, 153, 153),  # poles
    (157, 234, 50),  # road lines
    (128, 64, 128),  # roads
    (244, 35, 232),  # sidewalks
    (107, 142, 35),  # vegetation
    (0, 0, 255),  # vehicles
    (102, 102, 156),  # walls
    (220, 220, 0),  # traffic signs
], numpy.uint8)

# Metres at which depth is 1.
FAR_M = 1000.0


def to_bgra_array(image):
    """H x W x 4 bytes: blue, green, red, alpha."""
    pixels = numpy.frombuffer(image.raw_data, dtype=numpy.uint8)
    return pixels.reshape(image.height, image.width, 4)


def to_rgb_array(image):
    """H x W x 3 bytes: red, green, blue."""
    return to_bgra_array(image)[:, :, 2::-1]


def labels_to_array(image):
    """H x W labels, 0 to 12."""
    return to_bgra_array(image)[:, :, 2]


def labels_to_cityscapes_palette(image):
    """H x W x 3: the labels as colours."""
    return PALETTE[numpy.minimum(labels_to_array(image), 12)].astype(float)


def depth_to_array(image):
    """H x W: depth from 0 to 1, which is 1000 m."""
    pixels = to_bgra_array(image).astype(numpy.float32)
    depth = pixels[:, :, 2] + pixels[:, :, 1] * 256.0 + pixels[:, :, 0] * 65536.0
    return depth / (256.0**3 - 1.0)


def depth_to_logarithmic_grayscale(image):
    """H x W x 3: near things dark, far things bright, 0 to 255."""
    depth = depth_to_array(image)
    with numpy.errstate(divide="ignore"):
        grey = 1.0 + numpy.log(depth) / 5.70378
    grey = numpy.clip(grey, 0.005, 1.0) * 255.0
    return numpy.repeat(grey[:, :, numpy.newaxis], 3, axis=2)


def depth_to_local_point_cloud(image, color=None, max_depth=0.9):
    """The points of a depth image: x left, y up, z ahead, in metres.

    Points beyond `max_depth` (of 1, which is 1000 m) are left out; `color` is an H x W x 3 array.
    """
    from .sensor import PointCloud

    depth = depth_to_array(image).ravel()
    height, width = image.height, image.width
    focal = width / (2.0 * numpy.tan(numpy.radians(image.fov) / 2.0))
    # The first pixel is the upmost on the left; both axes point the other way.
    left, up = numpy.meshgrid(
        numpy.arange(width - 1, -1, -1), numpy.arange(height - 1, -1, -1))
    is_near = depth <= max_depth
    metres = depth[is_near] * FAR_M
    points = numpy.stack([
        (left.ravel()[is_near] - width / 2.0) / focal * metres,
        (up.ravel()[is_near] - height / 2.0) / focal * metres,
        metres,
    ], axis=1)
    colours = None if color is None else color.reshape(-1, 3)[is_near]
    return PointCloud(image.frame_number, points, colours)
