"""Small robot files for the tests of config: a YAML text and a URDF text that fit each other."""

from pathlib import Path

URDF = """<robot name="two">
  <link name="base"><inertial><mass value="20"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="lift" type="revolute">
    <origin xyz="0 0 0.2"/><parent link="base"/><child link="arm"/><axis xyz="0 -2 0"/>
    <limit lower="-1.5" upper="1.5" effort="40" velocity="1"/></joint>
  <link name="arm"><inertial><origin xyz="0.5 0 0"/><mass value="4"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic">
    <origin xyz="1 0 0"/><parent link="arm"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.3" effort="100" velocity="1"/></joint>
  <link name="hand"/>
</robot>"""

YAML = """robot: {name: two}
urdf: two.urdf
joints:
  lift:
    limit_nm: 30
  slide:
    limit_n: 100
contacts:
  a: {link: base, position_m: [1, 1, 0]}
  b: {link: base, position_m: [-1, 1, 0]}
  c: {link: base, position_m: [0, -1, 0]}
payload: {link: hand, mass_kg: 1}
"""


def write_robot(folder: Path, yaml: str = YAML, urdf: str = URDF) -> Path:
    """Write both files into `folder` and return the YAML's path."""
    (folder / 'two.urdf').write_text(urdf, encoding='utf-8')
    path = folder / 'two.yaml'
    path.write_text(yaml, encoding='utf-8')
    return path
