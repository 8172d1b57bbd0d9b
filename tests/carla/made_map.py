"""An OpenDRIVE map of one straight road that has every lane type, marking and sign of CARLA."""

import carla

# Lanes from the centre to the right and to the left: numbers -1, -2, … and 1, 2, ….
RIGHT = ["driving", "driving", "stop", "shoulder", "biking", "sidewalk", "border", "restricted",
         "parking", "median", "none"]
LEFT = ["driving", "bidirectional", "special1", "special2", "special3", "roadWorks", "tram", "rail",
        "entry", "exit", "offRamp", "onRamp"]
# The marking on the right edge of each lane to the right.
MARKINGS = ["broken", "solid", "solid solid", "solid broken", "broken solid", "broken broken",
            "botts dots", "grass", "curb", "custom", "none"]
COLOURS = ["white", "blue", "green", "red", "yellow", "standard", "orange"]
CHANGES = ["both", "increase", "decrease", "none"]
LENGTH_M, WIDTH_M = 420.0, 3.0
# Signs in order along the road.
SIGNS = [name for name in dir(carla.LandmarkType) if not name.startswith("__")]
SPACING_M = 10.0
ORIENTATIONS = {"+": 0, "-": 1, "none": 2}


def colour(index):
    return COLOURS[index % len(COLOURS)]


def change(index):
    return CHANGES[index % len(CHANGES)]


def lane(number, kind, marking, index):
    return (f'<lane id="{number}" type="{kind}" level="false"><link/>'
            f'<width sOffset="0" a="{WIDTH_M}" b="0" c="0" d="0"/>'
            f'<roadMark sOffset="0" type="{marking}" weight="standard" color="{colour(index)}" '
            f'width="0.2" laneChange="{change(index)}"/></lane>')


def sign(index, name):
    orientation = list(ORIENTATIONS)[index % 3]
    return (f'<signal s="{SPACING_M * (index + 1)}" t="-4" id="s{index}" name="{name}" dynamic="no" '
            f'orientation="{orientation}" zOffset="2.5" country="OpenDRIVE" '
            f'type="{getattr(carla.LandmarkType, name)}" subtype="7" value="{30 + index}" '
            f'unit="km/h" height="0.75" width="0.5" text="{name}" hOffset="0.25" pitch="0.125" '
            'roll="0.0625"><validity fromLane="-2" toLane="-1"/></signal>')


def text():
    """Returns the text of the map. The road begins at the origin and follows the x axis."""
    right = "".join(lane(-1 - i, kind, MARKINGS[i], i) for i, kind in enumerate(RIGHT))
    left = "".join(lane(len(LEFT) - i, kind, "none", 0)
                   for i, kind in enumerate(reversed(LEFT)))
    signs = "".join(sign(i, name) for i, name in enumerate(SIGNS))
    corners = "".join(f'<cornerLocal u="{u}" v="{v}" z="0"/>'
                      for u, v in ((-1.5, -3), (1.5, -3), (1.5, 3), (-1.5, 3), (-1.5, -3)))
    return f"""<?xml version="1.0"?>
<OpenDRIVE>
<header revMajor="1" revMinor="4" name="Made" north="50" south="-50" east="420" west="0">
<geoReference><![CDATA[+proj=tmerc +lat_0=49 +lon_0=8 +k=1 +x_0=0 +y_0=0 +datum=WGS84]]></geoReference>
</header>
<road name="Made" length="{LENGTH_M}" id="1" junction="-1">
<type s="0" type="town"><speed max="50" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="{LENGTH_M}"><line/></geometry></planView>
<lanes><laneSection s="0">
<left>{left}</left>
<center><lane id="0" type="none" level="false">
<roadMark sOffset="0" type="solid" weight="standard" color="yellow" width="0.15" laneChange="none"/>
</lane></center>
<right>{right}</right>
</laneSection></lanes>
<objects>
<object type="crosswalk" id="c1" name="Crosswalk" s="400" t="0" zOffset="0" orientation="none"
 length="3" width="6" hdg="0" pitch="0" roll="0"><outline>{corners}</outline></object>
<object type="roadmark" id="m1" name="Stencil_ArrowType1" s="50" t="-1.5" zOffset="0.5"
 orientation="+" length="2" width="1" hdg="0.25" pitch="0.125" roll="0.0625"/>
<object type="roadmark" id="m2" name="Stencil_ArrowType2" s="60" t="-1.5" zOffset="0"
 orientation="-" length="2" width="1" hdg="0" pitch="0" roll="0"/>
<object type="roadmark" id="m3" name="Stencil_ArrowType3" s="70" t="-1.5" zOffset="0"
 orientation="none" length="2" width="1" hdg="0" pitch="0" roll="0"/>
</objects>
<signals>{signs}</signals>
</road>
</OpenDRIVE>
"""
