"""Measured joint efforts beside the static model."""
