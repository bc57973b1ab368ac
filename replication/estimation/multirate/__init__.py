"""Multi-rate observers: periodically time-varying gains for sensors with different periods (Okajima et al., 2023)."""
