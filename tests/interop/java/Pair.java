import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/**
 * Runs FMUs joined by connections, all outputs read before an input is set, and prints one number per step.
 *
 * <p>Arguments: importer (fmi4j, javafmi), step size, number of steps, variable to print, then
 * {@code NAME=FILE.fmu}, {@code NAME.VARIABLE=VALUE} and {@code NAME.OUTPUT>NAME.INPUT}.
 */
final class Pair {
    private static final Map<String, Slave> slaves = new LinkedHashMap<>();
    private static final List<String[]> connections = new ArrayList<>();

    private static Slave slave(String path) {
        return slaves.get(path.substring(0, path.indexOf('.')));
    }

    private static String variable(String path) {
        return path.substring(path.indexOf('.') + 1);
    }

    private static void set(String path, String value) {
        if (value.equals("true") || value.equals("false")) {
            slave(path).set(variable(path), Boolean.parseBoolean(value));
        } else if (value.matches("-?\\d+")) {
            slave(path).set(variable(path), Integer.parseInt(value));
        } else {
            slave(path).set(variable(path), Double.parseDouble(value));
        }
    }

    private static void exchange() {
        double[] values = new double[connections.size()];
        for (int i = 0; i < values.length; i++) {
            String from = connections.get(i)[0];
            values[i] = slave(from).get(variable(from));
        }
        for (int i = 0; i < values.length; i++) {
            String to = connections.get(i)[1];
            slave(to).set(variable(to), values[i]);
        }
    }

    public static void main(String[] arguments) throws Exception {
        double size = Double.parseDouble(arguments[1]);
        int steps = Integer.parseInt(arguments[2]);
        String printed = arguments[3];
        for (int i = 4; i < arguments.length; i++) {
            String[] parts = arguments[i].split("[=>]", 2);
            if (arguments[i].contains(">")) {
                connections.add(parts);
            } else if (parts[0].contains(".")) {
                set(parts[0], parts[1]);
            } else {
                slaves.put(parts[0], arguments[0].equals("fmi4j") ? new Fmi4j(parts[1]) : new JavaFmi(parts[1]));
            }
        }
        for (Slave slave : slaves.values()) slave.enterInitialization();
        for (int i = 0; i < 2; i++) exchange(); // the force follows the tip
        for (Slave slave : slaves.values()) slave.exitInitialization();
        StringBuilder rows = new StringBuilder("ROWS");
        for (int i = 0; i < steps; i++) {
            if (i == steps / 2) for (Slave slave : slaves.values()) slave.throughBytes();
            for (Slave slave : slaves.values()) slave.step(i * size, size);
            exchange();
            rows.append(' ').append(slave(printed).get(variable(printed)));
        }
        for (Slave slave : slaves.values()) slave.close();
        System.out.println(rows);
    }
}
