from .can import Jr3CanNode as Jr3CanNode
from .sensor import Jr3Config as Jr3Config
from .uart import UART_CONFIG as UART_CONFIG
from .uart import Jr3UartNode as Jr3UartNode
