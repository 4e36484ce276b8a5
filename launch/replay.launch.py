"""A recording played into the monitor: `ros2 launch ugv_acceptance replay.launch.py bag:=run1`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def ours(name: str) -> PythonLaunchDescriptionSource:
    """Return another launch file of this package."""
    share = FindPackageShare('ugv_acceptance')
    return PythonLaunchDescriptionSource(PathJoinSubstitution([share, 'launch', name]))


def generate_launch_description() -> LaunchDescription:
    """Return monitor, console and a player that publishes the recording on its own topics."""
    robot = {
        'config': LaunchConfiguration('config'),
        'namespace': LaunchConfiguration('namespace'),
    }
    watched = {**robot, 'params_file': LaunchConfiguration('params_file')}
    return LaunchDescription(
        [
            DeclareLaunchArgument('bag', description='recording: a rosbag2 folder or one file'),
            DeclareLaunchArgument(
                'config',
                default_value='packbot',
                description='YAML file that describes the robot, or the name of one that ships',
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument(
                'rate', default_value='1.0', description='speed, as a multiple of real time'
            ),
            DeclareLaunchArgument(
                'loop', default_value='false', description='start again at the end'
            ),
            DeclareLaunchArgument(
                'restamp',
                default_value='true',
                description='move header stamps to now: the monitor compares them with its clock',
            ),
            DeclareLaunchArgument(
                'console', default_value='true', description='serve the operator page as well'
            ),
            DeclareLaunchArgument(
                'params_file',
                default_value='',
                description='YAML file of parameters of the monitor; config counts before it',
            ),
            IncludeLaunchDescription(ours('monitor.launch.py'), launch_arguments=watched.items()),
            IncludeLaunchDescription(
                ours('console.launch.py'),
                launch_arguments=robot.items(),
                condition=IfCondition(LaunchConfiguration('console')),
            ),
            Node(
                package='ugv_acceptance',
                executable='bag_player',
                name='bag_player',
                namespace=LaunchConfiguration('namespace'),
                output='screen',
                parameters=[
                    {
                        'bag': ParameterValue(LaunchConfiguration('bag'), value_type=str),
                        'rate': ParameterValue(LaunchConfiguration('rate'), value_type=float),
                        'loop': ParameterValue(LaunchConfiguration('loop'), value_type=bool),
                        'restamp': ParameterValue(LaunchConfiguration('restamp'), value_type=bool),
                    }
                ],
            ),
        ]
    )
