"""Waymark's simulated robot and a session that drives it, shown in RViz: no Gazebo, no robot.

    ros2 launch waymark simulation.launch.py

The scripted driver teaches a lap, maps it and replays it without operator.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    world = LaunchConfiguration("world")
    return LaunchDescription([
        DeclareLaunchArgument("world", default_value="circuit24", description="World of the simulated robot"),
        DeclareLaunchArgument("folder", default_value="waymark_session", description="Where recordings and maps are written"),
        ExecuteProcess(cmd=["waymark", "robot-sim", "--world", world, "--images", "--ros2"], output="screen"),
        ExecuteProcess(
            cmd=["waymark", "run", "--robot", "ros2:limo-sim", "--world", world, "--driver", "scripted",
                 "--publish-ros2", "--output", LaunchConfiguration("folder")],
            output="screen"),
        Node(package="rviz2", executable="rviz2",
             arguments=["-d", [FindPackageShare("waymark"), "/rviz/waymark.rviz"]]),
    ])
