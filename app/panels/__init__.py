"""The panels on the right: Level, Edit, Steps."""
