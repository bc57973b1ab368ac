"""All figures of the audit."""

from papers.shao.figures_readings import READING_FIGURES
from papers.shao.figures_stability import STABILITY_FIGURES
from papers.shao.figures_tracking import TRACKING_FIGURES

FIGURES = (*TRACKING_FIGURES, *STABILITY_FIGURES, *READING_FIGURES)
