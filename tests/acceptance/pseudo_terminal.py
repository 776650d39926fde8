"""A serial port whose other end is a TCP connection, made by socat."""
import os
import pty
import selectors
import socket
import threading
import tty


class PseudoTerminal:
    """`read(count)` and `write(data)` at the port `name`, like a driver of a serial port."""

    def __init__(self, address, port, patience_s):
        self.socket = socket.create_connection((address, port), timeout=patience_s)
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.name = os.ttyname(self.slave)
        self.wake = os.pipe()
        self.thread = threading.Thread(target=self.carry)

    def carry(self):
        with selectors.DefaultSelector() as ready:
            for end in (self.master, self.socket, self.wake[0]):
                ready.register(end, selectors.EVENT_READ)
            while True:
                ends = [key.fileobj for key, _ in ready.select()]
                if self.wake[0] in ends:
                    return
                if self.master in ends:
                    self.socket.sendall(os.read(self.master, 4096))
                if self.socket in ends:
                    os.write(self.master, self.socket.recv(4096))

    def read(self, count):
        return os.read(self.slave, count)

    def write(self, data):
        os.write(self.slave, data)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.wake[1], b".")
        self.thread.join()
        self.socket.close()
        for end in (self.master, self.slave, *self.wake):
            os.close(end)
