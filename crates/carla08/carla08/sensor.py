"""Specifications of sensors, and their data."""

import os

import numpy

from . import image_converter, png
from .transform import Rotation, Scale, Transform, Translation

# The labels of 0.8 by the tags of 0.9.16; other tags are 0, none.
LABELS = numpy.zeros(256, numpy.uint8)
for _new, _old in {
    1: 7, 2: 8, 3: 1, 4: 11, 5: 2, 6: 5, 7: 12, 8: 12, 9: 9, 10: 9, 12: 4, 13: 4, 14: 10, 15: 10,
    16: 10, 17: 10, 18: 10, 19: 10, 20: 3, 21: 3, 22: 3, 24: 6, 26: 3, 27: 3, 28: 2,
}.items():
    LABELS[_new] = _old


class Sensor:
    """A name, and a pose in the player vehicle: metres, degrees, left-handed."""

    def __init__(self, name, sensor_type):
        self.SensorName = name
        self.SensorType = sensor_type
        self.PositionX = 0.2
        self.PositionY = 0.0
        self.PositionZ = 1.3
        self.RotationPitch = 0.0
        self.RotationRoll = 0.0
        self.RotationYaw = 0.0

    def set(self, **given):
        """Changes attributes by name; raises ValueError for an unknown name."""
        for name, value in given.items():
            name = {"CameraFOV": "FOV"}.get(name, name)
            if name not in self.__dict__:
                raise ValueError(f"{self.SensorName}: no key named {name!r}")
            setattr(self, name, value)

    def set_position(self, x, y, z):
        """Sets the position: metres forward, right, up."""
        self.PositionX, self.PositionY, self.PositionZ = x, y, z

    def set_rotation(self, pitch, yaw, roll):
        """Degrees."""
        self.RotationPitch, self.RotationYaw, self.RotationRoll = pitch, yaw, roll

    def get_transform(self):
        """Returns vehicle_from_sensor."""
        return Transform(
            Translation(self.PositionX, self.PositionY, self.PositionZ),
            Rotation(self.RotationPitch, self.RotationYaw, self.RotationRoll))

    def get_unreal_transform(self):
        """Returns the transform from the space of `depth_to_local_point_cloud` to the vehicle."""
        return self.get_transform() * Transform(Rotation(roll=-90, yaw=90), Scale(x=-1))

    def fields(self):
        """Returns the section of the ini file."""
        return {name: value for name, value in self.__dict__.items() if name != "SensorName"}


class Camera(Sensor):
    """PostProcessing: None, SceneFinal, Depth or SemanticSegmentation."""

    BLUEPRINTS = {
        "None": "sensor.camera.rgb",
        "SceneFinal": "sensor.camera.rgb",
        "Depth": "sensor.camera.depth",
        "SemanticSegmentation": "sensor.camera.semantic_segmentation",
    }

    def __init__(self, name, **given):
        super().__init__(name, "CAMERA")
        self.PostProcessing = "SceneFinal"
        self.ImageSizeX = 720
        self.ImageSizeY = 512
        self.FOV = 90.0
        self.set(**given)

    def set_image_size(self, pixels_x, pixels_y):
        """Pixels."""
        self.ImageSizeX, self.ImageSizeY = pixels_x, pixels_y

    def blueprint(self):
        """Returns the blueprint of 0.9.16 and its attributes."""
        kind = str(self.PostProcessing)
        if kind not in self.BLUEPRINTS:
            raise ValueError(f"{self.SensorName}: PostProcessing is {kind!r}, not one of "
                             f"{', '.join(self.BLUEPRINTS)}")
        return self.BLUEPRINTS[kind], {
            "image_size_x": self.ImageSizeX, "image_size_y": self.ImageSizeY, "fov": self.FOV}

    def measurement(self, data, frame_number):
        """Converts an image of 0.9.16."""
        return Image(frame_number, data.width, data.height, str(self.PostProcessing), data.fov,
                     bytes(data.raw_data))


class Lidar(Sensor):
    """A rotating lidar; metres, degrees, rotations per second."""

    def __init__(self, name, **given):
        super().__init__(name, "LIDAR_RAY_CAST")
        self.Channels = 32
        self.Range = 50.0
        self.PointsPerSecond = 56000
        self.RotationFrequency = 10.0
        self.UpperFovLimit = 10.0
        self.LowerFovLimit = -30.0
        self.ShowDebugPoints = False
        self.set(**given)

    def blueprint(self):
        """Returns the blueprint of 0.9.16 and its attributes; no points are dropped, as in 0.8."""
        return "sensor.lidar.ray_cast", {
            "channels": self.Channels, "range": self.Range,
            "points_per_second": self.PointsPerSecond,
            "rotation_frequency": self.RotationFrequency, "upper_fov": self.UpperFovLimit,
            "lower_fov": self.LowerFovLimit, "dropoff_general_rate": 0.0,
            "dropoff_intensity_limit": 1.0, "dropoff_zero_intensity": 0.0}

    def measurement(self, data, frame_number):
        """Converts a point cloud of 0.9.16."""
        points = numpy.frombuffer(data.raw_data, dtype=numpy.float32).reshape(-1, 4)[:, :3]
        counts = numpy.array([data.get_point_count(i) for i in range(data.channels)])
        return LidarMeasurement(frame_number, data.horizontal_angle, data.channels, counts,
                                PointCloud(frame_number, points.copy()))


class SensorData:
    """Base class of sensor data."""

    def __init__(self, frame_number):
        self.frame_number = frame_number


class Image(SensorData):
    """An image: BGRA bytes in `raw_data`, and its converted contents in `data`."""

    def __init__(self, frame_number, width, height, image_type, fov, raw_data):
        super().__init__(frame_number)
        if len(raw_data) != 4 * width * height:
            raise ValueError(f"{len(raw_data)} bytes are not an image of {width} x {height}")
        if image_type == "SemanticSegmentation":
            pixels = numpy.frombuffer(raw_data, numpy.uint8).reshape(-1, 4).copy()
            pixels[:, 2] = LABELS[pixels[:, 2]]
            raw_data = pixels.tobytes()
        self.width, self.height = width, height
        self.type = image_type
        self.fov = fov
        self.raw_data = raw_data
        self._converted = None

    @property
    def data(self):
        """Returns depth from 0 to 1, labels, or red, green and blue."""
        if self._converted is None:
            convert = {
                "Depth": image_converter.depth_to_array,
                "SemanticSegmentation": image_converter.labels_to_array,
            }.get(self.type, image_converter.to_rgb_array)
            self._converted = convert(self)
        return self._converted

    def __getitem__(self, key):
        return self.data[key]

    def save_to_disk(self, filename, format=".png"):
        """Writes the unconverted bytes as a PNG file, depth and labels too."""
        if not filename.lower().endswith(format.lower()):
            filename += format
        if not filename.lower().endswith(".png"):
            raise ValueError(f"{filename!r}: images are written as .png")
        png.write(filename, image_converter.to_rgb_array(self))


class PointCloud(SensorData):
    """Points, N x 3 in metres, with optional colors."""

    def __init__(self, frame_number, array, color_array=None):
        super().__init__(frame_number)
        self.array = array
        self.color_array = color_array
        self.has_colors = color_array is not None

    def keys(self):
        """Returns a point, whose x, y and z can be read by name."""
        return ("x", "y", "z")

    def apply_transform(self, transformation):
        """Transforms every point."""
        self.array = transformation.transform_points(self.array)

    def save_to_disk(self, filename, format=".ply"):
        """Writes a PLY file in ASCII."""
        if not filename.lower().endswith(format.lower()):
            filename += format
        folder = os.path.dirname(filename)
        if folder:
            os.makedirs(folder, exist_ok=True)
        names = ["property float32 " + axis for axis in "xyz"]
        columns, form = self.array, "%.4f %.4f %.4f"
        if self.has_colors:
            names += [f"property uchar {c}" for c in ("red", "green", "blue")]
            columns = numpy.hstack([self.array, self.color_array])
            form += " %d %d %d"
        header = "\n".join(["ply", "format ascii 1.0", f"element vertex {len(self.array)}", *names,
                            "end_header"])
        with open(filename, "w", encoding="ascii") as file:
            numpy.savetxt(file, columns, form, header=header, comments="")

    def __len__(self):
        return len(self.array)

    def __getitem__(self, key):
        return self.array[key]

    def __iter__(self):
        return iter(self.array)


class LidarMeasurement(SensorData):
    """Points in sensor space: x forward, y right, z up."""

    def __init__(self, frame_number, horizontal_angle, channels, counts, point_cloud):
        super().__init__(frame_number)
        self.horizontal_angle = horizontal_angle
        self.channels = channels
        self.point_count_by_channel = counts
        self.point_cloud = point_cloud

    @property
    def size_in_bytes(self):
        """Returns the number of points."""
        return self.point_cloud.array.nbytes

    @property
    def data(self):
        """Returns the points, N x 3."""
        return self.point_cloud.array

    def save_to_disk(self, filename, format=".ply"):
        """Writes a PLY file."""
        self.point_cloud.save_to_disk(filename, format)
