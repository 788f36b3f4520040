"""docs/reference/kernels.md is what its tool makes of the catalogue."""

from tools import kernel_page


def test_the_page_is_that_of_the_catalogue():
    assert kernel_page.PAGE.read_text(encoding="utf-8") == kernel_page.page()
