"""Motor records of EPICS for the motors of bushd: `python3 -m bushd_epics --prefix LAB:`.

`fields` says which fields a record has, `record` what they mean, without caproto and without a socket: events and the time go in,
what is to be done comes out. `daemon` carries that out by `bushd.aio`, `server` shows the fields by Channel Access (caproto).
"""
