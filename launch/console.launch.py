"""The console beside a monitor: `ros2 launch ugv_acceptance console.launch.py port:=8770`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description() -> LaunchDescription:
    """Return the console as a node; it prints the address to open in a browser."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                'config',
                default_value='packbot',
                description='YAML file that describes the robot, or the name of one that ships',
            ),
            DeclareLaunchArgument(
                'urdf', default_value='', description='URDF in place of the one the YAML names'
            ),
            DeclareLaunchArgument(
                'namespace', default_value='', description='namespace of the robot'
            ),
            DeclareLaunchArgument(
                'use_sim_time', default_value='false', description='take the time from /clock'
            ),
            DeclareLaunchArgument(
                'host',
                default_value='127.0.0.1',
                description='address to listen on; others than 127.0.0.1 need a token',
            ),
            DeclareLaunchArgument(
                'port', default_value='8770', description='port; 0 takes a free one'
            ),
            DeclareLaunchArgument(
                'token', default_value='', description='word that a browser must bring'
            ),
            DeclareLaunchArgument(
                'respawn',
                default_value='false',
                description='true: start the console again whenever it ends by itself',
            ),
            Node(
                package='ugv_acceptance',
                executable='ugv-acceptance',
                name='acceptance_console',
                namespace=LaunchConfiguration('namespace'),
                output='screen',
                respawn=LaunchConfiguration('respawn'),
                respawn_delay=2.0,
                arguments=[
                    'console',
                    ['--config=', LaunchConfiguration('config')],
                    ['--urdf=', LaunchConfiguration('urdf')],
                    ['--host=', LaunchConfiguration('host')],
                    ['--port=', LaunchConfiguration('port')],
                    ['--token=', LaunchConfiguration('token')],
                ],
                parameters=[
                    {
                        'use_sim_time': ParameterValue(
                            LaunchConfiguration('use_sim_time'), value_type=bool
                        )
                    }
                ],
            ),
        ]
    )
