"""The bench: reads a wheel transmitter, estimates with an FMU, records, replays and shows.

=============  ====================================================================
`wire`         what a wheel sends: frames, samples, counts, clocks, conditions
`protocols`    bytes to frames and back; the published database; the load of a bus
`links`        serial, CAN, slcan and socket ports
`estimator`    samples to the FMU, its outputs to turns
`setup`        the setup file and the sources in it
`recording`    files: written first, read, repaired, replayed, exported
`emulator`     a wheel transmitter that is played
`live`         the processes of a run and what they share
`page`         the live page, in the browser or in the terminal
`cli`          the program ``tirebench``
=============  ====================================================================

A room imports only from rooms above it in this table (import-linter holds that).
"""
