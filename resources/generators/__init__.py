"""The code that made the sample meshes; needed only to make them again."""
