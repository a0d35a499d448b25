"""Models from files and texts: URDF, SDF, MJCF, USD, xacro; and files of loops and stiffness."""
