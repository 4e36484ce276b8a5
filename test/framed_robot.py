"""A small robot with an IMU and feet on links of their own, under different root links."""

from pathlib import Path

BODY = """
  <link name="base_link">
    <inertial><origin xyz="0.01 0.02 0.1"/><mass value="20"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="feet_link"/>
  <joint name="feet_joint" type="fixed">
    <parent link="base_link"/><child link="feet_link"/><origin xyz="0 0 -0.1" rpy="0 0 1.5708"/>
  </joint>
  <link name="imu_link"/>
  <joint name="imu_joint" type="fixed">
    <parent link="base_link"/><child link="imu_link"/>
    <origin xyz="0.19 0.05 0.149" rpy="1.5708 0 0.5"/>
  </joint>
  <link name="arm_link">
    <inertial><origin xyz="0.4 0 0"/><mass value="3"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="arm_joint" type="revolute">
    <parent link="base_link"/><child link="arm_link"/><origin xyz="0.1 0 0.2"/>
    <axis xyz="0 -1 0"/><limit lower="-1.5" upper="1.5" effort="30" velocity="2"/>
  </joint>
  <link name="hand_imu"/>
  <joint name="hand_imu_joint" type="fixed">
    <parent link="arm_link"/><child link="hand_imu"/><origin xyz="0.8 0 0" rpy="0 1.5708 0"/>
  </joint>
"""
# What stands above base_link: nothing, or a root link from which it is shifted and turned.
ABOVE = {
    'base_link': '',
    'base_footprint': """
  <link name="base_footprint"/>
  <joint name="base_joint" type="fixed">
    <parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.1"/>
  </joint>
""",
    'world': """
  <link name="world"/>
  <joint name="world_joint" type="fixed">
    <parent link="world"/><child link="base_link"/><origin xyz="1 -2 0.4" rpy="0 0 0"/>
  </joint>
""",
}
# Height (m) of the ground in the axes of each root link.
GROUND = {'base_link': -0.1, 'base_footprint': 0.0, 'world': 0.3}
FEET = ((0.4, 0.3), (0.4, -0.3), (-0.4, 0.3), (-0.4, -0.3))


def robot_files(
    folder: Path, root: str = 'base_link', imu: str = '{mounting: auto}', more: str = ''
) -> Path:
    """Write the URDF and the YAML file of the robot under a root link; return the latter's path.

    `more` stands in the YAML's section `robot`.
    """
    urdf = f'<robot name="framed">{ABOVE[root]}{BODY}</robot>'
    (folder / 'framed.urdf').write_text(urdf, 'utf-8')
    contacts = ''.join(
        f'  foot_{k}: {{link: feet_link, position_m: [{x}, {y}, 0]}}\n'
        for k, (x, y) in enumerate(FEET)
    )
    path = folder / 'framed.yaml'
    path.write_text(
        f'robot: {{name: framed{more}}}\nurdf: framed.urdf\nimu: {imu}\ncontacts:\n{contacts}'
        f'ground: {{height_m: {GROUND[root]}, kind: flat}}\npayload: {{link: arm_link}}\n',
        'utf-8',
    )
    return path
