"""Artefacts of the instrument in a force record: quantisation, dropouts, hum, AC coupling."""
