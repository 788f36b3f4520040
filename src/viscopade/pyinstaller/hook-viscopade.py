"""What a frozen program needs: records and templates, and modules whose names no import statement has."""

from PyInstaller.utils.hooks import collect_data_files, collect_submodules

datas = collect_data_files("viscopade")
hiddenimports = [*collect_submodules("viscopade"), *collect_submodules("flint", filter=lambda name: "test" not in name)]
