/* USB as a serial port (CDC-ACM), so that hosts need no driver. */
#ifndef TOMOSKIN_USB_H
#define TOMOSKIN_USB_H

void usb_start(void);

#endif
