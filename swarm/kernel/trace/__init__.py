"""Helpers of kernels, traced into the kernels that call them."""
