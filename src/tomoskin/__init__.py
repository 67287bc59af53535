"""tomoskin: touch for soft robots by electrical impedance tomography."""

__version__ = "0.1.0"
