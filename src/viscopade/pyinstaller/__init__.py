"""What PyInstaller asks for when it freezes a program that uses viscopade: the folder with our hook."""

__all__ = ["folders"]


def folders() -> list[str]:
    """Return the folders of hooks, for the entry point `hook-dirs`."""
    return list(__path__)
