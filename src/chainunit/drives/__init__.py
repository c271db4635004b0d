"""Drives: motors and their control. A motor owns the shaft and takes the machine's load port."""
