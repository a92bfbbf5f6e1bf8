"""Reports without figures: to draw them takes most of a page's time."""

from __future__ import annotations

from impactsig.report import experiment, figures, findings, fitted


def leave_out_figures(patch):
    """Draw none on the pages of recordings, but those of an experiment's own page."""
    draw_figure = figures.draw_figure
    for module in (figures, findings, fitted):
        patch.setattr(module, "draw_figure", lambda *_: "data:,")

    def draw(paint, width, height):
        return draw_figure(lambda figure: paint(figure.subplots()), width, height)

    patch.setattr(experiment, "draw", draw)
