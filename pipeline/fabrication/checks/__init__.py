"""Reads back every file of a package and refuses it if a cutter, a printer or a hand would."""
