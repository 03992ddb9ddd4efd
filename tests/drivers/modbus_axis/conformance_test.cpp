// Every check of the conformance suite, over both kinds of wire and with both makes of drive.
#include "tests/drivers/conformance_tests.h"
#include "tests/drivers/modbus_axis/bench.h"

namespace rig::drivers::modbus {

RIG_CONFORMANCE_TESTS(ModbusRtu, make_rtu_bench);
RIG_CONFORMANCE_TESTS(ModbusTcp, make_tcp_bench);

}  // namespace rig::drivers::modbus
