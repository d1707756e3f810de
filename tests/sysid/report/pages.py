"""What tests ask of any report."""

from plotly.offline import get_plotlyjs

MOST = 10e6  # bytes of a page


def own_part(page: str) -> str:
    """Returns a page without Plotly's script, after what holds for every page.

    The script is in it once, nothing is fetched from elsewhere, and it is not large.
    """
    script = get_plotlyjs()
    assert page.count(script) == 1
    rest = page.replace(script, "")
    for outside in ("http", "src=", "@import", "<link"):
        assert outside not in rest.replace('src="data:', ""), outside
    assert len(page.encode()) < MOST
    return rest
