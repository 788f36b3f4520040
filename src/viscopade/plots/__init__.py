"""Pictures for users: eps against speed, and measured data with the law fitted to them."""

__all__ = ["fit_picture", "sheet", "speeds"]
