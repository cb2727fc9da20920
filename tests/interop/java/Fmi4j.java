import java.io.File;
import no.ntnu.ihb.fmi4j.FmiStatus;
import no.ntnu.ihb.fmi4j.SlaveInstance;
import no.ntnu.ihb.fmi4j.importer.AbstractFmu;

/** By FMI4j (JNI). */
final class Fmi4j implements Slave {
    private final AbstractFmu fmu;
    private final SlaveInstance slave;

    Fmi4j(String path) throws Exception {
        fmu = AbstractFmu.from(new File(path));
        slave = fmu.asCoSimulationFmu().newInstance();
        Slave.check(slave.setupExperiment(0.0, 0.0, 0.0), "setupExperiment");
    }

    private long[] reference(String name) {
        return new long[] {slave.getModelDescription().getValueReference(name)};
    }

    private void ok(FmiStatus status, String name) {
        Slave.check(status == FmiStatus.OK, name);
    }

    public void set(String name, double value) {
        ok(slave.writeReal(reference(name), new double[] {value}), name);
    }

    public void set(String name, int value) {
        ok(slave.writeInteger(reference(name), new int[] {value}), name);
    }

    public void set(String name, boolean value) {
        ok(slave.writeBoolean(reference(name), new boolean[] {value}), name);
    }

    public double get(String name) {
        double[] value = new double[1];
        ok(slave.readReal(reference(name), value), name);
        return value[0];
    }

    public void enterInitialization() {
        Slave.check(slave.enterInitializationMode(), "enterInitializationMode");
    }

    public void exitInitialization() {
        Slave.check(slave.exitInitializationMode(), "exitInitializationMode");
    }

    public void step(double time, double size) {
        Slave.check(slave.doStep(time, size), "doStep at " + time);
    }

    public void throughBytes() {
        long state = slave.getFMUstate();
        byte[] bytes = slave.serializeFMUstate(state);
        Slave.check(slave.freeFMUstate(state), "freeFMUstate");
        long again = slave.deSerializeFMUstate(bytes);
        Slave.check(slave.setFMUstate(again), "setFMUstate");
        Slave.check(slave.freeFMUstate(again), "freeFMUstate");
    }

    public void close() {
        Slave.check(slave.terminate(), "terminate");
        fmu.close();
    }
}
